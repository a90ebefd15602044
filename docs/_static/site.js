// What the theme leaves out: names and levels for screen readers, keyboard access to what scrolls,
// cells that hold a sentence, and the list of versions beside this one.
"use strict";

// Another element in the place of one, with its content.
function replaceTag(element, tag) {
    const other = document.createElement(tag);
    other.className = element.className;
    other.append(...element.childNodes);
    element.replaceWith(other);
    return other;
}

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
            replaceTag(head, "td");
        }
    });
    document.querySelectorAll("td").forEach((cell) => {
        cell.classList.toggle("sentence", cell.textContent.trim().length > 40);
    });
    // Signatures over several lines are lists of parameters, not of terms.
    document.querySelectorAll("dt > dl").forEach((list) => {
        list.querySelectorAll(":scope > dd").forEach((entry) => replaceTag(entry, "li"));
        replaceTag(list, "ul").style = "list-style: none; margin: 0 0 0 2rem; padding: 0";
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
