// From a hand held still to a gesture that is checked and saved. No page here.

import { HoldStill } from "./hold.js";
import { accepted, verdict } from "./verdict.js";

/**
 * Takes pictures while the hand is held still, has them checked, and saves them if they are good.
 * While one gesture is saved the next may be shown; it is checked when the one before is saved.
 */
export class Burst {
    #take;
    #act;
    #pictures = [];
    #saving = Promise.resolve();
    #run = 0;

    /**
     * @param {function(): Promise<?Blob>} take one picture
     * @param {{check: function(Blob[], ?string), save: function(object, Blob[])}} act ask the server; both throw
     *   ApiError
     */
    constructor(take, act) {
        this.#take = take;
        this.#act = act;
        this.hold = new HoldStill();
    }

    /** Wait for a gesture; what was taken so far is nothing. */
    next() {
        this.#run += 1;
        this.#pictures = [];
        this.hold.next();
    }

    /** What HoldStill says; takes the pictures that are due. */
    update(now, hand) {
        const said = this.hold.update(now, hand);
        if (said.due < this.#pictures.length) this.#pictures = [];
        while (this.#pictures.length < said.due) {
            // A camera that is just taken away gives none.
            this.#pictures.push(this.#take().catch(() => null));
        }
        return said;
    }

    /**
     * Have the pictures of `gesture` checked once they are taken; `sign` is the starter sign that they
     * have to show, or null.
     * @returns {Promise<?object>} see verdict(), with `pictures` to save, and all of them with what the
     *   server says of each as `taken`, [{picture, image}]; null when next() was called meanwhile. Throws
     *   ApiError.
     */
    async judge(gesture, sign = null) {
        const run = this.#run;
        const pictures = (await Promise.all(this.#pictures)).filter(Boolean);
        await this.#saving;
        if (run !== this.#run) return null;
        if (!pictures.length) {
            return { good: false, usable: false, code: "no_picture", reason: "", other: null, pictures, taken: [] };
        }
        const answer = await this.#act.check(pictures, sign);
        if (run !== this.#run) return null;
        const taken = pictures.map((picture, index) => ({ picture, image: answer.images[index] }));
        return { ...verdict(answer, gesture.id), pictures: accepted(answer, pictures), taken };
    }

    /** Save pictures as the samples of `gesture`; `failed(error)` is called if that fails. */
    save(gesture, pictures, failed) {
        this.#saving = this.#act.save(gesture, pictures).catch(failed);
        return this.#saving;
    }

    /** Resolves when what was to be saved is. */
    get saved() {
        return this.#saving;
    }
}
