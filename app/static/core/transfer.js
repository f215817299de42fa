// Files to and from the server, with how far they are and a way to stop them.

import { ApiError } from "./api.js";
import { proofHeaders } from "./sign-in.js";

const cancelled = () => new ApiError(409, "cancelled", "");

function errorOf(status, text) {
    let error = {};
    try {
        error = JSON.parse(text).error || {};
    } catch {
        // a proxy's own page
    }
    return new ApiError(status, error.code || "http", error.message || "", error.detail);
}

/** Send a file; gives the answer's JSON. `onProgress(part)` from 0 to 1. Throws ApiError. */
export function upload(path, file, type, { onProgress = () => {}, signal }) {
    return new Promise((resolve, reject) => {
        // Not fetch(): it does not tell how much has gone.
        const request = new XMLHttpRequest();
        request.open("POST", new URL(path, document.baseURI));
        const headers = { ...proofHeaders(), "Content-Type": type };
        for (const [name, value] of Object.entries(headers)) request.setRequestHeader(name, value);
        request.upload.onprogress = ({ loaded, total }) => onProgress(total ? loaded / total : 0);
        request.onload = () => {
            if (request.status >= 200 && request.status < 300) resolve(JSON.parse(request.responseText));
            else reject(errorOf(request.status, request.responseText));
        };
        request.onerror = () => reject(new ApiError(0, "unreachable", ""));
        request.onabort = () => reject(cancelled());
        if (signal.aborted) reject(cancelled());
        else {
            signal.addEventListener("abort", () => request.abort());
            request.send(file);
        }
    });
}

/** Fetch a file; gives {blob, name}. `onProgress(bytes)` as they come. Throws ApiError. */
export async function download(path, { onProgress = () => {}, signal } = {}) {
    try {
        const answer = await fetch(new URL(path, document.baseURI), {
            headers: proofHeaders(),
            signal,
            cache: "no-store",
        });
        if (!answer.ok) throw errorOf(answer.status, await answer.text());
        const reader = answer.body.getReader();
        const parts = [];
        let bytes = 0;
        for (;;) {
            const { done, value } = await reader.read();
            if (done) break;
            parts.push(value);
            bytes += value.length;
            onProgress(bytes);
        }
        const said = /filename="([^"]+)"/.exec(answer.headers.get("Content-Disposition") || "");
        const type = answer.headers.get("Content-Type") || "";
        return { blob: new Blob(parts, { type }), name: said ? said[1] : "gestures.zip" };
    } catch (error) {
        if (signal && signal.aborted) throw cancelled();
        throw error instanceof ApiError ? error : new ApiError(0, "unreachable", "");
    }
}
