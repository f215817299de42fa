// Every word of the page, in German: the twin of en.js.

import { phrases } from "./de-server.js";
import { asSentence, plural } from "./forms.js";

export { phrases };

export const texts = Object.freeze({
    title: "Farhand",
    skip: "Zum Cockpit springen",
    stop: "STOPP",
    stopHint: "Leertaste",
    stopLabel: "Roboter stoppen",
    stopStates: {
        sending: "Stoppt …",
        stopped: "Gestoppt",
        failed: "Nicht bestätigt",
    },
    stopFailed:
        "Der Stopp wurde nicht bestätigt. Drücken Sie noch einmal STOPP, oder verdecken Sie die " +
        "Kamera: Ohne Bilder hält der Roboter von selbst an.",

    numbers: {
        decimal: ",",
        percent: (number) => `${number}\u00a0%`,
        quote: (text) => `„${text}“`,
    },

    language: {
        note: "Die Seite lädt neu. Wer gerade steuert, gibt die Steuerung damit ab.",
    },

    headings: {
        header: "Zustand",
        stage: "Roboter",
        operator: "Ihre Hand",
        gestures: "Gesten",
        readout: "Arm",
        dock: "Bedienung",
    },

    modes: {
        unknown: "Kein Roboter",
        disarmed: "Gesperrt",
        armed: "Freigegeben",
        moving: "Bewegt sich",
        holding: "Hält still",
        stopped: "Gestoppt",
        faulted: "Störung",
    },

    driver: {
        nobody: "Niemand steuert",
        you: "Sie steuern",
        other: (name) => `${name} steuert, Sie sehen zu`,
    },

    connection: {
        connecting: "Verbindet …",
        open: "Verbunden",
        waiting: (seconds) => `Kein Server, neuer Versuch in ${seconds} s`,
        "signed-out": "Abgemeldet",
    },

    gone: {
        title: "Der Server antwortet nicht",
        words:
            "Der Roboter hält von selbst an, wenn keine Bilder bei ihm ankommen. Kommt die " +
            "Verbindung zurück, ist nichts freigegeben.",
        retry: "Jetzt versuchen",
        awayTitle: "Der Server hat die Verbindung beendet",
        awayWords: (why) => `Er sagt: ${why}. Diese Seite versucht es von selbst weiter.`,
        signedOutTitle: "Sie sind abgemeldet",
        signedOutWords:
            "Öffnen Sie den Link, den der Server beim Start ausgegeben hat. Er meldet diesen Browser an.",
        reload: "Seite neu laden",
    },

    steps: { source: "Eingabe", control: "Steuerung", armed: "Freigabe" },

    actions: {
        // Where a narrow button may break them.
        start: "Fahrt be\u00adginnen",
        take: "Steuern",
        takeOver: "Ablösen",
        release: "Ab\u00adgeben",
        arm: "Frei\u00adgeben",
        disarm: "Sperren",
        reset: "Zurück\u00adsetzen",
        teach: "Geste einlernen",
        help: "Hilfe",
        close: "Schließen",
        cancel: "Abbrechen",
        retry: "Noch einmal",
    },

    takeOver: {
        title: "Jemand anderes steuert",
        words: (name) =>
            `${name} steuert gerade. Sie können um die Steuerung bitten; ${name} übergibt sie oder fährt weiter. ` +
            "Lösen Sie ab, hält der Arm sofort an. In beiden Fällen muss er neu freigegeben werden.",
    },

    people: {
        ask: "Um die Steuerung bitten",
        asked: (name) => `${name} wird um die Steuerung gebeten.`,
        asks: (name, more) =>
            more > 0 ? `${name} und ${more} weitere bitten um die Steuerung.` : `${name} bittet um die Steuerung.`,
        handOver: "Übergeben",
        keep: "Weiterfahren",
        yours: "Sie haben die Steuerung. Geben Sie den Roboter frei, um zu fahren.",
        watching: (count) => (count === 1 ? "1 weitere Person hier" : `${count} weitere Personen hier`),
    },

    speed: {
        label: "Tempo",
        fine: "Fein",
        fineHint: "Ein Fünftel des üblichen Tempos (F)",
    },

    resetScene: {
        button: "Alles zurückstellen",
        when: "Solange der Roboter gesperrt oder gestoppt ist",
        title: "Alles zurückstellen?",
        words:
            "Alles Bewegliche springt dorthin zurück, wo es am Anfang war, auch aus dem Greifer. " +
            "Der Arm bewegt sich nicht.",
        yes: "Zurückstellen",
        done: "Alles steht wieder an seinem Platz.",
    },

    sentence: {
        connecting: "Verbindung zum Server wird aufgebaut …",
        gone: "Die Verbindung ist weg. Der Roboter hält von selbst an; der Server wird gesucht.",
        signedOut: "Abgemeldet. Öffnen Sie den Link, den der Server ausgegeben hat.",
        noRobot: "Der Roboter antwortet noch nicht.",
        fault: (why) => `Der Roboter hat eine Störung: ${why}`,
        faultUnknown: "kein Grund angegeben",
        stopped: (why) => (why ? `Gestoppt: ${why}.` : "Gestoppt."),
        stoppedNext: "Setzen Sie zurück, wenn es sicher ist; dabei bewegt sich nichts.",
        stoppedWatch: "Wer steuern darf, kann zurücksetzen.",
        watching: "Niemand steuert. Sie sehen zu und können den Roboter stoppen.",
        noSource: "Zeigen Sie dem Roboter eine Hand: mit Ihrer Kamera, mit der gezeichneten Hand oder per Tasten.",
        sourceStarting: "Wartet auf die Kamera. Erlauben Sie sie im Browser, falls er fragt.",
        noControl: "Übernehmen Sie die Steuerung, um zu fahren.",
        otherDrives: (name) => `${name} steuert. Sie sehen zu; Ihre Gesten bewegen nichts.`,
        disarmed: "Geben Sie den Roboter frei, dann bewegen ihn Gesten.",
        disarmedKeys: "Geben Sie den Roboter frei, dann bewegen ihn Tasten.",
        disarmedWhy: (why) => `Gesperrt: ${why}. Geben Sie frei, um weiterzufahren.`,
        holding: (why) => (why ? `Hält still: ${why}.` : "Hält still."),
        holdingNext: "Zeigen Sie eine halbe Sekunde lang keine Geste, dann wieder eine.",
        holdingKeys: "Lassen Sie eine halbe Sekunde los, dann drücken Sie wieder.",
        readyKeys: "Bereit. Halten Sie einen Knopf oder eine Taste.",
        // Why it holds, when what you show or see cannot be trusted.
        doubts: {
            no_hand: "Ihre Hand ist nicht im Bild",
            unknown_hand: "Ihre Hand zeigt keine Geste, die er kennt",
            two_hands: "zwei Hände sind im Bild, und er gehorcht nur einer",
            low_margin: "Ihre Hand liegt zwischen zwei Gesten, und er rät nicht",
            frozen: "Ihre Kamera sendet immer dasselbe Bild; schalten Sie sie aus und wieder ein",
            stale_picture: "das Bild vom Roboter, das Sie sehen, ist alt",
        },
        noFrames: "Beim Server kommen keine Bilder an. Ist die Kamera verdeckt oder die Seite verborgen?",
        waitingPicture: "Wartet auf die ersten Bilder …",
        ready: "Bereit. Zeigen Sie eine Geste.",
        moving: (what) => `Bewegt sich: ${what}.`,
        movingHold: (gesture, what) => `„${gesture}“: ${what}, solange Sie die Geste halten.`,
        done: (gesture) => `„${gesture}“ ist getan. Senken Sie die Hand, dann zeigen Sie die nächste Geste.`,
        seen: (gesture) => `Sieht „${gesture}“.`,
        seenIdle: (gesture, next) => `Sieht „${gesture}“. ${next}`,
        limits: (limits) => `Grenze: ${limits}.`,
    },

    stage: {
        views: { wrist: "Kamera am Handgelenk", scene: "Szenenkamera", "3d": "3D-Ansicht" },
        enlarge: (view) => `Groß zeigen: ${view}`,
        swap: "Handgelenk und Szene tauschen (W)",
        noPicture: "Noch kein Bild",
        noCamera: "Die Kamera antwortet nicht",
        age: (seconds) => `${seconds} s alt`,
        hide: "3D-Ansicht ausblenden",
        show: "3D-Ansicht zeigen",
        slow3d: "Sie ist auf diesem Rechner langsam und bremst auch die Kamera.",
        no3d: "Dieser Browser kann hier kein 3D zeichnen (WebGL ist aus). Die Kamerabilder tun dasselbe.",
        loading3d: "3D-Ansicht lädt …",
        failed3d: "Die 3D-Ansicht ließ sich nicht laden.",
    },

    operator: {
        useCamera: "Meine Kamera benutzen",
        useCameraWords: "Ihr Bild geht nur an diesen Server und wird nicht aufbewahrt.",
        trySynthetic: "Keine Kamera? Ausprobieren",
        trySyntheticWords: "Eine gezeichnete Hand zeigt die Gesten, immer wieder.",
        useKeys: "Mit Tasten fahren",
        useKeysWords: "Tastatur, Knöpfe oder Gamepad. Gesten braucht es nicht.",
        choose: "Kamera",
        otherCamera: (number) => `Kamera ${number}`,
        front: "Vordere Kamera",
        rear: "Hintere Kamera",
        stop: "Ausschalten",
        demonstration: "Vorführung",
        asking: "Wartet auf die Kamera …",
        shows: (gesture) => `Zeigt „${gesture}“`,
        showsNothing: "Zwischen zwei Gesten",
        previewLabel: "Ihr Bild, gespiegelt, mit der gefundenen Hand",
    },

    // What the recognition makes of the hand, in one sentence.
    thought: {
        noSource: "Kein Bild: Wählen Sie oben eine Kamera.",
        waiting: "Wartet auf die ersten Bilder.",
        noFrames: "Seit einer Weile wurde kein Bild ausgewertet.",
        causes: {
            no_hand: "Keine Hand im Rahmen.",
            two_hands: "Zwei Hände im Rahmen: Zeigen Sie eine.",
            waiting: "Wartet auf drei Bilder, um zu sehen, was sich bewegt.",
            nothing_enrolled: "Noch ist keine Geste eingelernt: Es gibt nichts zu vergleichen.",
            moving: "Die Hand bewegt sich: Halten Sie sie still.",
            unknown_hand: "Die Hand gleicht keiner eingelernten Geste.",
            low_margin: "Zwei Gesten sind etwa gleich nah: Zeigen Sie eine deutlicher.",
        },
        movingNear: (first) => `Vielleicht „${first}“, aber die Hand bewegt sich: Halten Sie still.`,
        tooFar: (first) => `Am nächsten ist „${first}“, doch zu weit weg, um zu zählen.`,
        unlike: (first) => `Am nächsten ist „${first}“, doch der Umriss gleicht keinem eingelernten.`,
        between: (first, second) =>
            `Am nächsten ist „${first}“, fast ebenso nah „${second}“: Zeigen Sie es deutlicher.`,
        settling: (first) => `Am nächsten ist „${first}“: Halten Sie still.`,
        settlingNext: (first, second) => `Am nächsten ist „${first}“, vor „${second}“: Halten Sie still.`,
        sure: (first) => `Es ist „${first}“.`,
        sureNext: (first, second) => `Es ist „${first}“; „${second}“ liegt weiter weg.`,
    },

    glass: {
        title: "So wird Ihre Hand gelesen",
        failed: "Die Schritte ließen sich nicht laden.",
        steps: "Die Schritte der Reihe nach",
        unreached: "nicht erreicht",
        mask: "Maske",
        maskValue: (share) => `${share} sind Hand`,
        maskNone: "keine Hand",
        maskAlt: (share) =>
            share ? `Die Hand, weiß: ${share} des Bildes` : "Nichts, was für eine Hand gehalten wird",
        motion: "Bewegung",
        motionValue: (share, limit) => `${share} von ${limit}`,
        motionAlt: (share, limit, still) =>
            `Was sich geändert hat, hell: ${share} des Bildes, ` +
            (still ? `unter ${limit}, also ruht die Hand` : `und unter ${limit} ruht sie`),
        wrist: "Handgelenk",
        wristValue: { bottom: "Schnitt unten", top: "Schnitt oben", left: "Schnitt rechts", right: "Schnitt links" },
        wristNone: "kein Arm abzuschneiden",
        wristAlt: {
            circle:
                "Wie viel Hand jede Zeile enthält, als Kurve; der Kreis der Handfläche; und der Schnitt, eine Zahl ihrer Radien entfernt",
            histogram:
                "Wie viel Hand jede Zeile enthält, als Kurve; und der Schnitt, wo die Kurve hinter der Handfläche am tiefsten ist",
            off: "Wie viel Hand jede Zeile enthält, als Kurve; nichts wird abgeschnitten",
        },
        region: "Ausschnitt",
        regionValue: (width, height) => `${width} × ${height}`,
        regionAlt: (width, height) => `Der Rahmen um die Hand: ${width} mal ${height} Punkte`,
        template: "Vorlage",
        templateValue: "60 × 80",
        templateAlt: "Was verglichen wird: die Hand mit 60 mal 80 Punkten",
        projection: "Projektion",
        projectionValue: (share) => `${share} aller Unterschiede`,
        projectionAlt: (near) =>
            "Jede eingelernte Vorlage auf den zwei Achsen, in denen sie sich am meisten unterscheiden, und Ihre Hand" +
            (near ? `, am nächsten bei „${near}“` : ", die jetzt nicht da ist"),
        legend: { first: "am nächsten", second: "an zweiter Stelle", you: "Ihre Hand" },
        nearest: "Nächste Vorlagen",
        noneNear: "Jetzt wird nichts verglichen.",
        nearestItem: (gesture, distance) => `„${gesture}“, Abstand ${distance}`,
        room: "Spielraum bis zur Ablehnung",
        distance: "Abstand",
        lead: "Vorsprung vor der zweiten",
        outline: "Fehler des Umrisses",
        atMost: (value, limit) => `${value}, höchstens ${limit}`,
        atLeast: (value, limit) => `${value}, mindestens ${limit}`,
        passes: "besteht",
        refused: "abgelehnt",
        mode: "Hand gefunden durch",
        modes: { threshold: "einfache Schwelle", learned: "gelernte Maske" },
        modeValue: (way, why) => (why ? `${way}, denn: ${why}` : way),
        rate: "Bilder",
        rateValue: (rate) => `${rate} pro Sekunde`,
        why: "Ausführlich",
        nothing: "–",
    },

    latency: {
        title: "Zeit von Ihrer Kamera bis zum Bild vom Roboter",
        total: (ms) => `${ms} ms`,
        whole: "Kamera bis Bild",
        partly: "der bekannten Teile",
        age: (ms) => `Bild ${ms} ms alt`,
        noPicture: "kein Bild",
        unknown: "nicht bekannt",
        none: "Noch wird nichts gesendet und nichts gezeigt.",
        ms: (ms) => (ms < 1 ? "unter 1 ms" : `${ms} ms`),
        short: {
            encode: "Kam",
            up: "hin",
            wait: "Halt",
            recognise: "lesen",
            motion: "Arm",
            picture: "Bild",
        },
        names: {
            encode: "Aufnehmen und Packen",
            up: "Weg zum Server",
            wait: "Warten, bis man dran ist",
            recognise: "Lesen der Hand",
            motion: "Weg zum Roboter, bis er sich bewegt",
            picture: "Bild davon, zurück zu Ihnen",
        },
        sum: "Zusammen",
        pictureAge: "Alter des Bildes jetzt",
    },

    sourceErrors: {
        denied: {
            title: "Der Browser gibt die Kamera nicht frei",
            words:
                "Erlauben Sie dieser Seite die Kamera (das Kamerazeichen in der Adresszeile) und " +
                "versuchen Sie es noch einmal. Oder fahren Sie ohne.",
        },
        none: {
            title: "Keine Kamera gefunden",
            words: "Schließen Sie eine an und versuchen Sie es noch einmal, oder fahren Sie ohne.",
        },
        busy: {
            title: "Ein anderes Programm benutzt die Kamera",
            words: "Schließen Sie das Programm oder den Tab, der sie zeigt, und versuchen Sie es noch einmal.",
        },
        gone: {
            title: "Diese Kamera ist nicht mehr da",
            words: "Wählen Sie eine andere, oder versuchen Sie es noch einmal.",
        },
        unplugged: {
            title: "Die Kamera wurde abgezogen",
            words: "Der Roboter hält still. Schließen Sie die Kamera wieder an und versuchen Sie es noch einmal.",
        },
        insecure: {
            title: "Diese Adresse ist für eine Kamera nicht sicher genug",
            words:
                "Browser öffnen die Kamera nur auf https:// oder auf localhost. Öffnen Sie die Seite " +
                "so, oder fahren Sie ohne Kamera.",
        },
        unsupported: {
            title: "Dieser Browser gibt Seiten keine Kamera",
            words: "Nehmen Sie einen aktuellen Browser, oder fahren Sie ohne Kamera.",
        },
        clip: {
            title: "Die Vorführung ließ sich nicht abspielen",
            words: "Der Server hat den Film nicht gesendet, oder dieser Browser kann kein WebM.",
        },
        failed: {
            title: "Die Kamera ließ sich nicht öffnen",
            words: "Versuchen Sie es noch einmal. Hilft das nicht, wählen Sie eine andere Kamera.",
        },
    },

    jog: {
        title: "Tasten",
        how: "Der Arm bewegt sich, solange Sie einen Knopf oder seine Taste halten.",
        gamepad:
            "Gamepad: Halten Sie eine Schultertaste und drücken Sie einen Stick. A schließt den Greifer, " +
            "X öffnet ihn, Y fährt in die Grundstellung, B stoppt.",
        groups: { move: "Bewegen", joint: "Gelenke", tool: "Greifer", pose: "Anfahren", program: "Programme" },
        moves: {
            forward: "Vor",
            back: "Zurück",
            left: "Links",
            right: "Rechts",
            up: "Hoch",
            down: "Runter",
            "turn-left": "Links drehen",
            "turn-right": "Rechts drehen",
            "tip-forward": "Vorkippen",
            "tip-back": "Zurückkippen",
            "roll-left": "Links rollen",
            "roll-right": "Rechts rollen",
            open: "Öffnen",
            close: "Schließen",
            home: "Grundstellung",
        },
        keys: {
            Shift: "⇧",
            ArrowUp: "↑",
            ArrowDown: "↓",
            ArrowLeft: "←",
            ArrowRight: "→",
            PageUp: "Bild↑",
            PageDown: "Bild↓",
        },
        joint: (name, sign) => `${name} ${sign < 0 ? "−" : "+"}`,
        picked: (joint) => `Die Tasten + und − drehen ${joint}; eine Ziffer wählt ein anderes.`,
        pose: (name) => name,
    },

    gestures: {
        legend: "Länger ist näher; jenseits der Marke zählt es.",
        empty: "Noch ist keine Geste eingelernt. Lernen Sie die erste ein.",
        loading: "Gesten laden …",
        failed: "Die Gesten ließen sich nicht laden.",
        edit: (name) => `„${name}“ ändern`,
        match: "Erkannt",
        noDistance: "–",
    },

    first: {
        begin: "Erste Minuten",
        goOn: "Erste Minuten fortsetzen",
        again: "Alle noch einmal einlernen",
        known: "Ich kenne das: losfahren",
        welcome:
            "In etwa zwei Minuten steuern Sie den Arm mit der eigenen Hand. Sie können jederzeit " +
            "gehen und später dort weitermachen.",
        disarmed: "Gesperrt, damit nichts bewegt, was Sie zeigen.",
        steps: "Die ersten Minuten",
        stepNames: {
            source: "Bild",
            whose: "Name",
            check: "Prüfen",
            teach: "Lernen",
            drive: "Fahren",
        },
        titles: {
            source: "Ihre ersten Minuten",
            whose: "Wessen Hand ist es?",
            check: "Ist Ihre Hand gut zu sehen?",
            teach: "Lernen Sie Ihre Gesten ein",
            drive: "Fahren Sie den Arm",
        },
        drawingOf: (name) => `So hält man die Hand für „${name}“`,
        // How the starter gestures are held, the palm to the camera.
        signs: {
            forward: "Zeige- und Mittelfinger hoch",
            back: "Vier Finger hoch, der Daumen in der Handfläche",
            left: "Eine Faust, der Daumen abgespreizt",
            right: "Der kleine Finger hoch",
            up: "Der Zeigefinger hoch",
            down: "Zeigefinger und kleiner Finger hoch",
            open: "Der Zeigefinger hoch, der Daumen abgespreizt",
            close: "Eine Faust",
            home: "Der kleine Finger hoch, der Daumen abgespreizt",
            stop: "Die offene Hand, der Daumen abgespreizt",
        },

        whose: {
            title: "Wessen Hand ist es?",
            open: (name) => `Wessen Hand: ${name}`,
            intro: "Hände sind verschieden. Alle lernen ihre eigenen Gesten einmal ein und wählen sie hier.",
            newName: "Ihr Name",
            nameMissing: "Geben Sie einen Namen an.",
            add: "Beginnen",
            known: "Wer hier bekannt ist",
            shared: "Alle",
            sharedWords: "Die gemeinsamen Gesten",
            taught: (taught, all) => `${taught} von ${all} Gesten eingelernt`,
            lost: "Diese Gesten wurden auf dem Server gelöscht. Jetzt gelten die gemeinsamen.",
        },

        check: {
            intro: "Halten Sie Ihre Hand wie auf der Zeichnung hoch, die Handfläche zur Kamera.",
            introPlain: "Halten Sie Ihre Hand hoch, die Handfläche zur Kamera.",
            go: "Weiter",
            left: "Ich nehme die linke Hand",
            good: "Sehr gut. Es geht weiter …",
            lines: { light: "Licht", distance: "Entfernung", background: "Hintergrund", still: "Ruhe" },
            signs: { good: "gut", fix: "geht besser", wait: "wartet" },
            advice: {
                light: {
                    wait: "Wartet auf das Bild.",
                    dark: "Zu dunkel. Schalten Sie vor sich Licht ein, oder drehen Sie sich zum Fenster.",
                    glare: "Zu hell. Drehen Sie sich von der Lampe weg, oder ziehen Sie einen Vorhang zu.",
                    behind: "Das Licht ist hinter Ihnen. Drehen Sie sich so, dass es auf Ihre Hand fällt.",
                    good: "Genug Licht.",
                },
                distance: {
                    wait: "Wartet auf das Bild.",
                    none: "Noch keine Hand zu sehen. Halten Sie sie hoch, eine Unterarmlänge vor die Kamera.",
                    cut: "Ihre Hand ragt aus dem Bild. Bewegen Sie sie in die Mitte.",
                    far: "Zu weit weg. Kommen Sie näher.",
                    near: "Zu nah. Gehen Sie ein wenig zurück.",
                    aside: "Bewegen Sie Ihre Hand in die Mitte des Bildes.",
                    good: "Ihre ganze Hand ist im Bild.",
                },
                background: {
                    wait: "Wartet auf Ihre Hand.",
                    two: "Zwei Hände, oder ein Gesicht, das so aussieht. Zeigen Sie nur eine Hand.",
                    faint: "Ihre Hand sieht aus wie das, was dahinter ist. Halten Sie sie vor eine andere Farbe.",
                    busy: "Nicht einfarbig, aber Ihre Hand wird gefunden.",
                    good: "Einfarbig. Ihre Hand hebt sich ab.",
                },
                still: {
                    wait: "Wartet auf Ihre Hand.",
                    moving: "Halten Sie Ihre Hand still.",
                    good: "Ihre Hand ruht.",
                },
            },
        },

        teach: {
            title: (name, number, all) => `${number} von ${all}: „${name}“`,
            all: "Alle Gesten",
            tile: (name, status) => `${name}: ${status}`,
            statuses: { now: "jetzt", open: "noch offen", taught: "eingelernt", skipped: "übersprungen" },
            phases: {
                change: "Jetzt diese: Ändern Sie Ihre Hand.",
                show: "Zeigen Sie dies, die Handfläche zur Kamera, und halten Sie still.",
                hold: "Halten Sie still …",
                taken: "Wird angesehen …",
            },
            looking: "Wird angesehen …",
            saving: "Wird gespeichert …",
            stops:
                "Diese stoppt den Roboter wirklich; Zurücksetzen macht ihn wieder bereit. Zeigen Sie sie, " +
                "und halten Sie still.",
            stopsOther: (name) => `Vorsicht: ${name} steuert gerade, und diese stoppt den Arm.`,
            taught: (name, near) =>
                near ? `„${name}“ ist eingelernt. Es liegt nicht weit von „${near}“.` : `„${name}“ ist eingelernt.`,
            kept: (name) => `„${name}“ bleibt so, wie es ist.`,
            skipped: (name) => `„${name}“ ist übersprungen; es bleibt, wie es war.`,
            notSaved: (name, why) => `„${name}“ wurde nicht gespeichert: ${why} Zeigen Sie es noch einmal.`,
            like: (name) => `Das sieht aus wie „${name}“.`,
            weak: (why, more) => [asSentence(why), asSentence(more), "Senken Sie die Hand, dann zeigen Sie es noch einmal."]
                .filter(Boolean)
                .join(" "),
            problems: {
                no_hand: "In den Bildern wurde keine Hand gefunden.",
                cut_off: "Ihre Hand ragt aus dem Bild.",
                too_small: "Ihre Hand ist zu weit weg.",
                two_hands: "Zwei Hände sind im Bild, oder etwas, das so aussieht.",
                no_wrist: "Ihr Handgelenk ist nicht zu sehen. Halten Sie die Hand höher, den Ärmel zurückgezogen.",
                blurred: "Die Bilder sind unscharf. Halten Sie still, und machen Sie mehr Licht.",
                no_picture: "Die Kamera gab kein Bild.",
                other: "Die Bilder sind nicht zu gebrauchen.",
            },
            keep: "So behalten",
            back: "Zurück (B)",
            redo: "Noch einmal (R)",
            skip: "Überspringen (S)",
            over: (taught, skipped) =>
                skipped
                    ? `${plural(taught, "Geste ist", "Gesten sind")} eingelernt, ${skipped} übersprungen.`
                    : `Alle ${taught} Gesten sind eingelernt.`,
        },

        drive: {
            list: {
                control: "Die Steuerung übernehmen",
                arm: "Freigeben",
                show: "Den Arm mit zwei Gesten bewegen",
                stop: "Ihn stoppen",
                reset: "Zurücksetzen",
            },
            tasks: {
                wait: () => "Wartet auf den Roboter.",
                ask: (name) => `${name} steuert gerade. Bitten Sie unten um die Steuerung.`,
                control: () => "Drücken Sie unten „Steuern“.",
                arm: () => "Drücken Sie unten „Freigeben“. Senken Sie vorher die Hand.",
                stop: () => "Stoppen Sie ihn jetzt: mit STOPP unten oder der Leertaste.",
                reset: () => "Der Roboter ist gestoppt. Drücken Sie unten „Zurücksetzen“: Das bewegt nichts.",
                done: () => "Das ist alles. Übernehmen Sie die Steuerung, geben Sie frei und fahren Sie.",
            },
            why: {
                control: "Immer nur eine Person steuert.",
                arm: "Ab dann bewegen Ihre Gesten den Roboter.",
                stop: "Das geht jederzeit, wer auch steuert.",
                reset: "Nach einem Stopp bewegt sich nichts, bis jemand zurücksetzt und freigibt.",
            },
            show: (name, moved) =>
                moved
                    ? `Sehr gut. Zeigen Sie nun „${name}“, und halten Sie es.`
                    : `Zeigen Sie „${name}“, und halten Sie es: So lange bewegt sich der Arm.`,
            watch: "Die gezeichnete Hand zeigt ihre Gesten. Sehen Sie zu, wie der Arm sich bewegt.",
            showWhy: "Senken Sie die Hand, dann steht er still.",
            finish: "Losfahren",
        },
    },

    readout: {
        joint: (number) => `J${number}`,
        jointLabel: (number, value) => `Gelenk ${number}: ${value}`,
        gripper: "Greifer",
        gripperOpen: (width) => `${width} mm offen`,
        tool: "Werkzeug",
        toolValue: (x, y, z) => `x ${x}  y ${y}  z ${z} cm`,
        place: "Ort",
        placeValue: (x, y, heading) => `x ${x}  y ${y} cm  ${heading}°`,
        slideValue: (way) => `${way} cm`,
        nothing: "in Ruhe",
        nearest: "Nächstes",
        nearestValue: (distance, thing, link) => `${distance} mm, ${thing} zu ${link}`,
        itself: (link) => `eigenes Teil: ${link}`,
        limits: "Grenzen",
    },

    action: {
        straight: {
            base: { "x+": "vor", "x-": "zurück", "y+": "links", "y-": "rechts", "z+": "hoch", "z-": "runter" },
            tool: {
                "x+": "entlang Werkzeug-x",
                "x-": "gegen Werkzeug-x",
                "y+": "entlang Werkzeug-y",
                "y-": "gegen Werkzeug-y",
                "z+": "entlang Werkzeug-z",
                "z-": "gegen Werkzeug-z",
            },
        },
        toolAxis: (axis) => `Werkzeug-${axis}`,
        linear: (direction, speed) => `${direction} ${speed} cm/s`,
        angular: (axis, speed) => `um ${axis} drehen ${speed}°/s`,
        jogJoint: (joint, speed) => `${joint} drehen ${speed}°/s`,
        turnJoint: (joint, angle) => `${joint} um ${angle}° drehen`,
        slideJoint: (joint, speed) => `${joint} schieben ${speed} cm/s`,
        slideJointBy: (joint, way) => `${joint} um ${way} cm schieben`,
        pose: (name) => `„${name}“ anfahren`,
        open: "Greifer öffnen",
        closed: "Greifer schließen",
        gripper: (width) => `Greifer auf ${width} mm`,
        force: (what, force) => `${what} mit ${force} N`,
        way: (direction, length) => `${length} cm ${direction}`,
        turnBy: (axis, angle) => `um ${axis} um ${angle}° drehen`,
        wait: (seconds) => `${seconds} s warten`,
        repeat: (times, what) => `${times}-mal: ${what}`,
        home: "Grundstellung",
        stop: "Roboter stoppen",
        stand: "stillstehen",
        lasting: (what, seconds) => `${what}, ${seconds} s lang`,
        sequence: (first, more) => (more ? `${first}, dann ${plural(more, "Schritt", "Schritte")}` : first),
        unknown: "unbekannte Aktion",
    },

    teach: {
        title: "Geste einlernen",
        editTitle: (name) => `„${name}“ ändern`,
        name: "Name der Geste",
        nameHint: "1 bis 60 Zeichen, etwa „winken“",
        nameMissing: "Geben Sie der Geste einen Namen.",
        action: "Was der Roboter tut",
        pictures: "Bilder der Hand",
        picturesHint: "Eines genügt; drei aus etwas verschiedenen Richtungen sind besser.",
        morePictures: "Bilder hinzufügen",
        enrolled: (count) => plural(count, "Bild eingelernt", "Bilder eingelernt"),
        capture: "Ein Bild aufnehmen",
        captureThree: "Drei aufnehmen",
        captureCancel: "Countdown abbrechen",
        countdown: (number) => `Halten Sie die Hand still: ${number}`,
        noSource: "Schalten Sie erst Ihre Kamera ein (unter „Ihre Hand“).",
        stillsMissing: "Nehmen Sie mindestens ein Bild der Hand auf.",
        still: (number) => `Bild ${number}`,
        removeStill: (number) => `Bild ${number} entfernen`,
        checking: "wird geprüft …",
        stillGood: "Hand gefunden",
        stillResembles: (name) => `Hand gefunden; sieht aus wie „${name}“`,
        resembles: (name) =>
            `Diese Hand sieht aus wie „${name}“. Eine unähnlichere Form wird sicherer unterschieden.`,
        save: "Geste speichern",
        saveChanges: "Änderungen speichern",
        saving: "Wird gespeichert …",
        saved: (name) => `„${name}“ ist gespeichert.`,
        deleted: (name) => `„${name}“ ist gelöscht.`,
        delete: "Löschen",
        deleteAsk: (name) => `„${name}“ und die Bilder dazu löschen? Das lässt sich nicht rückgängig machen.`,
        deleteYes: "Ja, löschen",
        deleteNo: "Behalten",
    },

    actionForm: {
        kind: "Aktion",
        kinds: {
            straight: "Geradeaus bewegen, solange gehalten",
            exact: "Mit genauem Tempo bewegen und drehen, solange gehalten",
            move_linear: "Um ein genaues Stück bewegen, geradlinig",
            jog_joint: "Ein Gelenk drehen, solange gehalten",
            turn_joint: "Ein Gelenk um einen Winkel drehen",
            pose: "Eine Stellung anfahren",
            gripper: "Greifer öffnen oder schließen",
            home: "In die Grundstellung fahren",
            stop: "Den Roboter stoppen",
            sequence: "Mehrere Schritte nacheinander",
            wait: "Warten",
            repeat: "Schritte wiederholen",
        },
        direction: "Richtung",
        frame: "Gesehen von",
        frames: { base: "der Basis des Roboters", tool: "dem Werkzeug" },
        speed: "Tempo, cm/s",
        jointSpeed: "Tempo, °/s (unter 0: andersherum)",
        joint: "Gelenk",
        angle: "Winkel, ° (unter 0: andersherum)",
        pose: "Stellung",
        width: "Öffnung, mm (0: geschlossen)",
        force: "Kraft, N (leer: so stark er kann)",
        ownSpeed: "Tempo, cm/s (leer: das eigene des Roboters)",
        offset: (axis) => `Entlang ${axis}, cm`,
        rotation: (axis) => `Um ${axis} drehen, °`,
        wait: "Wie lange, s",
        times: "Wie oft",
        linear: (axis) => `Entlang ${axis}, cm/s`,
        angular: (axis) => `Um ${axis}, °/s`,
        duration: "Wie lange, s",
        step: (number) => `Schritt ${number}`,
        addStep: "Schritt hinzufügen",
        removeStep: (number) => `Schritt ${number} entfernen`,
        upStep: (number) => `Schritt ${number} nach oben`,
    },

    check: {
        check: "Prüfen",
        checking: "Wird geprüft … Nichts bewegt sich.",
        from: "Prüfen ab",
        current: "der jetzigen Stellung des Arms",
        home: "der Grundstellung",
        good: (seconds) => `Nichts ist im Weg. Es dauert ${seconds} s.`,
        goodSlowed: (seconds) => `Es geht, stellenweise verlangsamt. Es dauert ${seconds} s.`,
        bad: (count) =>
            count === 1 ? "Es stößt an eine Grenze:" : `Es stößt an ${count} Grenzen:`,
        inStep: (step, what) => `Schritt ${step}: ${what}`,
        anywhere: (what) => what,
        after: (what, seconds) => `${what} (nach ${seconds} s)`,
        former: "Was sie vorher tat",
        formerNote: "Zurückholen ändert die Geste sofort.",
        noFormer: "Sie hat immer dies getan.",
        since: (when) => ` seit ${when}`,
        restore: "Zurückholen",
        restoreVersion: (version) => `Fassung ${version} zurückholen`,
        restored: (name) => `„${name}“ tut wieder, was es vorher tat.`,
    },

    errors: {
        unreachable: "Der Server antwortet nicht. Versuchen Sie es noch einmal, wenn die Verbindung zurück ist.",
        other: (status) => `Der Server hat abgelehnt (${status}).`,
        reset: "Das Zurücksetzen wurde nicht angenommen.",
        // By the server's codes; see docs/protocol.md.
        codes: {
            not_signed_in: "Sie sind abgemeldet. Öffnen Sie den Link, den der Server ausgegeben hat.",
            not_allowed: "Das ist Ihnen hier nicht erlaubt.",
            foreign_origin: "Diese Seite gehört nicht zu diesem Server. Öffnen Sie seinen Link.",
            gestures_lost: "Die Gestendatenbank ging verloren; bis sie da ist, kann nichts freigegeben werden.",
            not_found: "Das gibt es auf dem Server nicht mehr.",
            duplicate: "Diesen Namen gibt es schon. Wählen Sie einen anderen.",
            changed_meanwhile: "Jemand anderes hat das inzwischen geändert. Sehen Sie es sich noch einmal an.",
            no_control: "Sie haben die Steuerung nicht.",
            control_kept: "Wer steuert, fährt weiter.",
            nobody_asks: "Darum bittet niemand mehr.",
            control_lost: "Die Steuerung ist verloren.",
            shared_gallery: "Die gemeinsamen Gesten bleiben.",
            refused: "Der Roboter hat abgelehnt.",
            latched: "Der Roboter ist gestoppt: Setzen Sie ihn erst zurück.",
            moving: "Der Arm steht noch nicht still.",
            armed: "Das geht nur, solange der Roboter gesperrt oder gestoppt ist.",
            too_large: "Das ist zu groß für den Server.",
            invalid: "Ein Wert liegt außerhalb seiner Grenzen.",
            bad_action: "Das ist keine Aktion, die der Roboter kennt.",
            no_dry_run: "Ein Roboter, der fährt, lässt sich nicht vorab prüfen.",
            unknown_pose: "Diese Stellung kennt der Roboter nicht.",
            image_refused: "Auf dem Bild ist keine brauchbare Hand.",
            busy: "Gerade ist zu viel zu tun. Versuchen Sie es gleich noch einmal.",
            internal: "Im Server ging etwas schief; sein Protokoll sagt, was.",
            robot_unavailable: "Der Roboter antwortet nicht.",
            no_picture: "Die Kamera gab kein Bild.",
            viewer_unavailable: "Die 3D-Ansicht ist aus oder antwortet nicht.",
            database_broken: "Die Gestendatenbank lässt sich nicht lesen.",
            database_busy: "Ein anderes Programm belegt die Gestendatenbank.",
            disk_full: "Auf dem Server ist kein Platz mehr.",
        },
    },

    notices: {
        reconnected: "Wieder verbunden. Übernehmen Sie die Steuerung und geben Sie frei, um weiterzufahren.",
        lostControl: "Sie steuern nicht mehr.",
        dismiss: "Ausblenden",
    },

    preflight: {
        title: "Diesen Browser prüfen",
        open: "Kamera, Verbindung und 3D-Ansicht prüfen",
        checking: "Wird geprüft; der Browser fragt vielleicht nach der Kamera …",
        none: "Alles ist in Ordnung.",
        some: "Etwas fehlt. So beheben Sie es:",
        fine: {
            camera: "Die Kamera ist benutzbar",
            socket: "Laufende Verbindungen erreichen den Server",
            webgl: "3D lässt sich zeichnen",
        },
        problems: {
            socket: {
                title: "Laufende Verbindungen (WebSockets) sind blockiert",
                words:
                    "Die Seite kommt an, doch was den Roboter bewegt, nicht. Ein Proxy, ein Filter oder " +
                    "eine Browser-Erweiterung hält es auf: Schalten Sie die Erweiterung aus, nehmen Sie ein " +
                    "anderes Netz, oder bitten Sie die Betreiber des Proxys, WebSockets durchzulassen. Warnt " +
                    "der Browser vor dem Zertifikat, muss er ihm erst vertrauen: Öffnen Sie /trust an dieser Adresse.",
            },
            webgl: {
                title: "3D lässt sich nicht zeichnen (WebGL ist aus)",
                words:
                    "Fahren geht ohne, mit den Kamerabildern. Für 3D schalten Sie in den Einstellungen " +
                    "des Browsers die Hardwarebeschleunigung ein, oder nehmen Sie einen aktuellen Browser.",
            },
        },
    },

    help: {
        title: "Hilfe",
        how: [
            "Fahrt beginnen: Wählen Sie Ihre Kamera, ohne Kamera die gezeichnete Hand, oder Tasten.",
            "Steuern: Immer nur eine Person hat die Steuerung.",
            "Freigeben: Ab dann bewegen Ihre Gesten den Roboter.",
            "Zeigen Sie eine Geste und halten Sie still. Der Roboter bewegt sich, solange Sie sie halten, und hält an, wenn Sie die Hand senken.",
        ],
        keysTitle: "Tastenbelegung",
        keys: [
            ["Leertaste", "Stopp"],
            ["Esc", "Stoppt auch"],
            ["A", "Freigeben oder sperren"],
            ["C", "Steuerung übernehmen oder abgeben"],
            ["F", "Fein: ein Fünftel des Tempos"],
            ["W", "Handgelenk und Szene tauschen"],
            ["Pfeile, Bild↑, Bild↓", "Bei „Mit Tasten fahren“: bewegen; mit Umschalt: drehen"],
            ["1 bis 9, + und −", "Bei „Mit Tasten fahren“: ein Gelenk wählen und drehen"],
            ["O, G, H", "Bei „Mit Tasten fahren“: Greifer öffnen, schließen, Grundstellung"],
            ["?", "Diese Hilfe"],
        ],
        keysNote: "Die Leertaste stoppt immer; Knöpfe drücken Sie mit der Eingabetaste. Solange Sie in ein Feld schreiben, tun Tasten nichts.",
        safetyTitle: "Über das Stoppen",
        safety:
            "Der Stopp geht über ein Netz. Er ist kein Not-Halt im Sinne der ISO 13850. Kommen keine " +
            "Bilder mehr an, warum auch immer, steht der Roboter binnen einer halben Sekunde still.",
    },
});
