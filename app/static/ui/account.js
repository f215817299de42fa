// Who is signed in on this browser, and the way out.

import { language, texts } from "../texts/texts.js";
import { button, el } from "./dom.js";

const words = texts.account;
const day = new Intl.DateTimeFormat(language, { dateStyle: "long", timeStyle: "short" });

/** Contents of the sheet. `session` {role, token, name, expires}, or null where the server did not say. */
export function accountContent(session, signOut) {
    const lines = [];
    if (session) {
        lines.push(
            el("p", { id: "account-role", text: words.roles[session.role] || session.role }),
            el("p", { class: "quiet", id: "account-token", text: words.token(session.name || session.token) }),
            el("p", {
                class: "quiet",
                text: session.expires ? words.until(day.format(new Date(session.expires))) : words.forever,
            }),
        );
    } else lines.push(el("p", { class: "quiet", text: words.unknown }));
    return [
        ...lines,
        el("p", { text: words.what }),
        el("div", { class: "row end" }, button(words.signOut, { id: "sign-out", class: "primary", onclick: signOut })),
    ];
}
