// The half of a sign-in that this page holds.
//
// Cookies go to every port of a host, so the cookie alone opens nothing but the page's own files. The
// other half comes at the end of the address when somebody signs in (browsers send that to no server)
// and is kept where only pages of this very origin, port included, can read it.

const PROTOCOL = "farhand.v1";
const PAGE_PROTOCOL = "farhand.page.";
const HALF = /^#page=([0-9a-f]{64})\.([0-9a-f]{64})$/;
const KEPT = /^([0-9a-f]{64})\.([0-9a-f]{64})\.([0-9a-f]{16})$/;

// Of two servers below two paths of one host, each has its own.
const key = () => `farhand-page:${new URL(".", document.baseURI).pathname}`;
let unkept = ""; // where the browser keeps nothing

function kept() {
    let text = unkept;
    try {
        text = localStorage.getItem(key()) || unkept;
    } catch {
        // Then it lasts as long as the page.
    }
    return KEPT.exec(text);
}

function newBrowser() {
    const bytes = crypto.getRandomValues(new Uint8Array(8));
    return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** Take the half out of the address, where there is one. */
export function takeFromAddress() {
    const found = HALF.exec(location.hash);
    if (!found) return;
    history.replaceState(history.state, "", location.pathname + location.search);
    const before = kept();
    // The same name as before: the other tabs of this browser are signed out together.
    const text = `${found[1]}.${found[2]}.${before ? before[3] : newBrowser()}`;
    unkept = text;
    try {
        localStorage.setItem(key(), text);
        unkept = "";
    } catch {
        // Kept by this page alone.
    }
}

/** Forget it: this browser is signed out, in all of its tabs. */
export function forget() {
    unkept = "";
    try {
        localStorage.removeItem(key());
    } catch {
        // There was none.
    }
}

/** What a request shows beside the cookie, as headers. */
export function proofHeaders() {
    const found = kept();
    return found ? { "Farhand-Page": `${found[1]}.${found[3]}` } : {};
}

/** The same for a WebSocket, which cannot have headers: its subprotocols. */
export function proofProtocols() {
    const found = kept();
    return found ? [PROTOCOL, `${PAGE_PROTOCOL}${found[1]}.${found[3]}`] : [];
}

/** What stands in the addresses of pictures and of the 3D view; opens nothing else. */
export function ticket() {
    const found = kept();
    return found ? `${found[2]}.${found[3]}` : "";
}

takeFromAddress();
