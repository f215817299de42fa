/*
 * Loads before everything else, as a plain script, so that a mistake anywhere in the page is seen
 * by the person who drives, and not only in the console. Shows one banner; never hides the stop
 * button; never throws. The texts stand here because the modules may be what failed.
 */
(function () {
    "use strict";
    var shown = 0;

    function show(what) {
        try {
            shown += 1;
            var banner = document.getElementById("page-error");
            if (!banner) {
                banner = document.createElement("div");
                banner.id = "page-error";
                banner.className = "page-error";
                banner.setAttribute("role", "alert");
                var words = document.createElement("p");
                var button = document.createElement("button");
                button.type = "button";
                button.textContent = "Load the page again";
                button.addEventListener("click", function () {
                    location.reload();
                });
                banner.append(words, button);
                (document.body || document.documentElement).append(banner);
            }
            banner.querySelector("p").textContent =
                "Something went wrong in this page (" + what + "). If the robot moves and the " +
                "stop button does not answer, cover the camera: the robot stops by itself.";
        } catch (error) {
            // There is nothing left to show it with.
        }
    }

    window.addEventListener("error", function (event) {
        if (event.message && event.message.indexOf("ResizeObserver") >= 0) return; // harmless
        if (event.target && event.target !== window) {
            // A part of the page did not arrive. Pictures may fail; scripts and styles may not.
            if (/^(SCRIPT|LINK)$/.test(event.target.tagName)) {
                show("a file did not load: " + (event.target.src || event.target.href));
            }
            return;
        }
        show(event.message || "unknown error");
    }, true);
    window.addEventListener("unhandledrejection", function (event) {
        var reason = event.reason;
        show(reason && reason.message ? reason.message : String(reason));
    });
})();
