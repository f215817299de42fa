// Small choices that outlive the page; a browser may refuse to keep them.

const key = (name) => `farhand-${name}`;

export const memory = Object.freeze({
    get(name) {
        try {
            return localStorage.getItem(key(name));
        } catch {
            return null;
        }
    },
    set(name, value) {
        try {
            localStorage.setItem(key(name), value);
        } catch {
            // Then it is forgotten.
        }
    },
});
