// What the theme leaves out: names and levels for screen readers, keyboard access to what scrolls,
// and the list of versions beside this one.
"use strict";

function completeMarkup() {
    document.querySelectorAll("[role=heading]:not([aria-level])").forEach((heading) => {
        heading.setAttribute("aria-level", "2");
    });
    const names = [["aside.sidebar-drawer", "Pages"], ["aside.toc-drawer", "On this page"]];
    names.forEach(([selector, name]) => {
        document.querySelector(selector)?.setAttribute("aria-label", name);
    });
    document.querySelectorAll("th").forEach((head) => {
        if (head.textContent.trim() === "") {
            const cell = document.createElement("td");
            cell.className = head.className;
            head.replaceWith(cell);
        }
    });
    // Signatures over several lines are lists of parameters without terms.
    document.querySelectorAll("dt > dl").forEach((list) => {
        list.setAttribute("role", "list");
        list.querySelectorAll(":scope > dd").forEach((entry) => {
            entry.setAttribute("role", "listitem");
        });
    });
    const main = document.querySelector("[role=main]");
    if (main !== null && document.querySelector("h1") === null) {
        const title = document.createElement("h1");
        title.textContent = document.title.split(" - ")[0];
        main.prepend(title);
    }
    document.querySelectorAll("pre, .table-wrapper").forEach((box) => {
        box.tabIndex = 0;
    });
}

// A script, not a request: pages opened as files may load nothing else.
function listVersions() {
    const list = document.getElementById("versions");
    const root = document.documentElement.dataset.content_root;
    if (list === null || root === undefined) {
        return;
    }
    const script = document.createElement("script");
    script.src = `${root}../versions.js`;
    script.onload = () => {
        window.siteVersions.filter((name) => name !== list.dataset.version).forEach((name) => {
            const link = document.createElement("a");
            link.href = `${root}../${name}/index.html`;
            link.textContent = name;
            list.append(" ", link);
        });
    };
    document.head.append(script);
}

document.addEventListener("DOMContentLoaded", () => {
    completeMarkup();
    listVersions();
});
