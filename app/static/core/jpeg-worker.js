// Encodes pictures off the page's own thread. On that thread browsers leave JPEG encoding to idle
// moments, and a page that draws a lot has none: frames would wait for 200 ms and more.

let canvas = null;
let context = null;

self.onmessage = async ({ data: { picture, width, height, quality } }) => {
    try {
        if (!canvas) {
            canvas = new OffscreenCanvas(width, height);
            // "Read frequently" keeps the canvas in main memory: nothing waits for the graphics
            // process, which the 3D view may keep busy.
            context = canvas.getContext("2d", { alpha: false, willReadFrequently: true });
        }
        if (canvas.width !== width || canvas.height !== height) {
            canvas.width = width;
            canvas.height = height;
        }
        context.drawImage(picture, 0, 0, width, height);
        picture.close();
        const blob = await canvas.convertToBlob({ type: "image/jpeg", quality });
        const jpeg = await blob.arrayBuffer();
        self.postMessage({ jpeg }, [jpeg]);
    } catch (error) {
        self.postMessage({ error: String(error) });
    }
};
