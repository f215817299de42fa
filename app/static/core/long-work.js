// Long work on the server: asked about until it has ended, cancelled when it is not wanted any more.

import { ApiError } from "./api.js";

const EVERY_MS = 300;
const MOST_SILENT = 40; // answers missed in a row before it is given up

/** Wait, or less when `signal` says that nobody wants to. */
function wait(ms, signal) {
    return new Promise((resolve) => {
        const end = () => {
            clearTimeout(timer);
            signal.removeEventListener("abort", end);
            resolve();
        };
        const timer = setTimeout(end, ms);
        signal.addEventListener("abort", end);
    });
}

/**
 * Follow a job (as the server tells it) to its end; gives its result.
 * @param api {job(id), cancelJob(id)}
 * @param onProgress called with the job whenever it is heard of
 * @param signal an AbortSignal: cancels the job. Whether it was still in time, its end says.
 * Throws ApiError: the job's own, with the code "cancelled" when it was cancelled.
 */
export async function follow(job, { api, onProgress = () => {}, signal = new AbortController().signal, everyMs = EVERY_MS }) {
    let asked = false; // to end
    let silent = 0;
    while (job.state === "running") {
        onProgress(job);
        if (!signal.aborted) await wait(everyMs, signal);
        else if (asked) await new Promise((go) => setTimeout(go, everyMs));
        try {
            const cancel = signal.aborted && !asked;
            job = await (cancel ? api.cancelJob(job.id) : api.job(job.id));
            asked ||= cancel;
            silent = 0;
        } catch (error) {
            if (error.status !== 0 || ++silent > MOST_SILENT) throw error;
        }
    }
    if (job.state === "done") return job.result;
    if (job.state === "cancelled") throw new ApiError(409, "cancelled", "");
    throw new ApiError(422, job.error.code, job.error.message, job.error.detail);
}
