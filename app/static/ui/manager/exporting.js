// The gallery as one file.

import { texts } from "../../texts/texts.js";
import { el, saveFile } from "../dom.js";
import { withProgress } from "./progress.js";

const words = texts.manager.export;

/** Fetch the file and hand it to the browser, which saves it where it saves files. */
export function exporting(panel, signal, { act }) {
    const work = ({ onProgress, signal: ended }) =>
        act.export({
            signal: ended,
            onProgress: (bytes) => onProgress(null, null, words.running(Math.ceil(bytes / 1024))),
        });
    return withProgress(panel, signal, words.running(0), work, ({ blob, name }) => {
        saveFile({ blob, name });
        return [el("p", { class: "quiet", role: "status", text: words.done(name) })];
    });
}
