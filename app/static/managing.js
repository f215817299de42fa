// The gesture manager, put together when it is first wanted.

import { change, request } from "./core/api.js";
import { follow } from "./core/long-work.js";
import { download, upload } from "./core/transfer.js";
import { managerContent } from "./ui/manager/manager.js";
import { loadStyles } from "./ui/dom.js";

const id = encodeURIComponent;
const ZIP = "application/zip";
const jobs = {
    job: (job) => request("GET", `api/jobs/${id(job)}`),
    cancelJob: (job) => request("DELETE", `api/jobs/${id(job)}`),
};

/** A job to its end; `onProgress(done, total)`. */
const toEnd = (job, { onProgress, signal }) =>
    follow(job, { api: jobs, signal, onProgress: ({ done, total }) => onProgress(done, total) });

/** Send a file, and follow what the server does with it: half of the way each. */
async function sent(path, file, { onProgress, signal }) {
    const job = await upload(path, file, ZIP, { signal, onProgress: (part) => onProgress(part, 2) });
    return toEnd(job, { signal, onProgress: (done, total) => onProgress(1 + (total && done / total), 2) });
}

/**
 * Contents for the manager's sheet.
 * @param api the calls that the page has anyway
 * @param undo an Undo: what is changed can be taken back
 */
export async function manager({ store, api, undo, edit }) {
    await loadStyles("static/styles/manager.css");
    const gallery = () => `api/galleries/${id(store.state.gallery)}`;
    const sample = (gesture, one) => `api/gestures/${id(gesture)}/samples/${id(one)}`;
    const { content, close } = managerContent({
        store,
        templateUrl: api.templateUrl,
        told: (text, changes) => undo.did(text, changes),
        edit,
        act: {
            rename: (gesture, name) => api.updateGesture(gesture, { name }),
            retire: (gesture, active) => api.updateGesture(gesture, { active }),
            deleteSample: (gesture, one) => change("DELETE", sample(gesture, one)),
            moveSample: (gesture, one, to) => change("POST", `${sample(gesture, one)}/move`, { json: { to } }),
            matrix: async (ways) => toEnd(await request("POST", `${gallery()}/matrix`), ways),
            check: (file, existing, ways) => sent(`${gallery()}/import?existing=${existing}&check=true`, file, ways),
            import: (file, existing, plan, ways) =>
                sent(`${gallery()}/import?existing=${existing}&plan=${id(plan)}`, file, ways),
            export: (ways) => download(`${gallery()}/export`, ways),
        },
    });
    const deaf = undo.listen(document);
    return {
        content,
        close() {
            deaf();
            close();
        },
    };
}
