// What the synthetic operator shows now; undefined while that is not known.

const LOOK_EVERY_MS = 150;

/** Keeps the store's `clipGesture` true to the clip that plays. */
export function followClip(api, store, video) {
    let captions = null;
    setInterval(async () => {
        const { kind, state } = store.state.source;
        if (kind !== "synthetic" || state !== "running") return;
        if (!captions) {
            captions = [];
            try {
                captions = await api.operatorCaptions();
            } catch {
                // Then there are no captions.
            }
        }
        const now = video.currentTime;
        const shown = captions.find(({ start_s, end_s }) => start_s <= now && now < end_s);
        store.set({ clipGesture: captions.length ? (shown ? shown.gesture : null) : undefined });
    }, LOOK_EVERY_MS);
}
