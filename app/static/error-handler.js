/*
 * Loads before everything else, as a plain script, so that a mistake anywhere in the page is seen
 * by the person who drives, and not only in the console. Shows one banner; never hides the stop
 * button; never throws. The texts stand here because the modules may be what failed.
 */
(function () {
    "use strict";
    var shown = 0;
    var WORDS = {
        en: {
            again: "Load the page again",
            what: "Something went wrong in this page (@). If the robot moves and the stop button " +
                "does not answer, cover the camera: the robot stops by itself.",
            file: "a file did not load: ",
            unknown: "unknown error"
        },
        de: {
            again: "Seite neu laden",
            what: "In dieser Seite ging etwas schief (@). Bewegt sich der Roboter und antwortet " +
                "STOPP nicht, verdecken Sie die Kamera: Der Roboter hält von selbst an.",
            file: "eine Datei wurde nicht geladen: ",
            unknown: "unbekannter Fehler"
        }
    };

    /** As texts/texts.js chooses, which may be what failed. */
    function words() {
        var wanted = (navigator.languages || []).slice();
        try {
            wanted.unshift(localStorage.getItem("farhand-language") || "");
        } catch (error) {
            // Then the browser's languages count alone.
        }
        for (var at = 0; at < wanted.length; at += 1) {
            var tongue = wanted[at].toLowerCase().split("-")[0];
            if (Object.prototype.hasOwnProperty.call(WORDS, tongue)) return WORDS[tongue];
        }
        return WORDS.en;
    }

    function show(what) {
        try {
            shown += 1;
            var banner = document.getElementById("page-error");
            if (!banner) {
                banner = document.createElement("div");
                banner.id = "page-error";
                banner.className = "page-error";
                banner.setAttribute("role", "alert");
                var told = document.createElement("p");
                var button = document.createElement("button");
                button.type = "button";
                button.textContent = words().again;
                button.addEventListener("click", function () {
                    location.reload();
                });
                banner.append(told, button);
                (document.body || document.documentElement).append(banner);
            }
            banner.querySelector("p").textContent = words().what.replace("@", function () {
                return what;
            });
        } catch (error) {
            // There is nothing left to show it with.
        }
    }

    window.addEventListener("error", function (event) {
        if (event.message && event.message.indexOf("ResizeObserver") >= 0) return; // harmless
        if (event.target && event.target !== window) {
            // A part of the page did not arrive. Pictures may fail; scripts and styles may not.
            if (/^(SCRIPT|LINK)$/.test(event.target.tagName)) {
                show(words().file + (event.target.src || event.target.href));
            }
            return;
        }
        show(event.message || words().unknown);
    }, true);
    window.addEventListener("unhandledrejection", function (event) {
        var reason = event.reason;
        show(reason && reason.message ? reason.message : String(reason));
    });
})();
