// Excerpts below search results, from the texts of pages in texts.js: Sphinx would fetch the pages, which a browser does not
// allow from disk.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const query = new URLSearchParams(location.search).get("q") ?? "";
  const words = query.toLowerCase().split(/[^\p{Letter}\p{Number}_]+/gu).filter((word) => word);
  const results = document.getElementById("search-results");
  if (!results || words.length === 0) return;
  const kLength = 240;
  const escaped = words.map((word) => word.replace(/[.*+?^${}()|[\]\\]/g, "\\$&").replace(/(?<=\w{3})s$/, "")); // plural and singular
  const any = new RegExp(`(${escaped.join("|")})`, "giu");
  const phrase = new RegExp(escaped.join("\\w*\\W+"), "iu");

  // Where most of the words occur within an excerpt; -1: nowhere.
  const densest = (text) => {
    const found = [...text.matchAll(any)];
    let best = -1;
    let most = 0;
    found.forEach((one, i) => {
      const near = new Set();
      for (let k = i; k < found.length && found[k].index < one.index + kLength / 2; ++k) near.add(found[k][0].toLowerCase());
      if (near.size > most) [best, most] = [one.index, near.size];
    });
    return best;
  };

  const excerpt = (text) => {
    let at = text.search(phrase);
    if (at < 0) at = densest(text);
    if (at < 0) return null;
    let begin = Math.max(0, at - 80);
    if (begin > 0) begin = text.indexOf(" ", begin) + 1;
    const end = Math.min(text.length, begin + kLength);
    const shown = document.createElement("p");
    shown.className = "context";
    const piece = (begin > 0 ? "… " : "") + text.slice(begin, end) + (end < text.length ? " …" : "");
    piece.split(any).forEach((part, i) => {
      if (i % 2 === 0) return shown.append(part);
      const mark = document.createElement("mark");
      mark.textContent = part;
      shown.append(mark);
    });
    return shown;
  };

  const add = (item) => {
    const link = item.querySelector?.("a");
    if (!link || item.querySelector(".context")) return;
    const name = link.getAttribute("href").replace(/(\.html)?[?#].*$|\.html$/, "");
    const text = kTexts[name];
    const found = text && excerpt(text);
    if (found) item.append(found);
  };
  new MutationObserver((changes) => changes.forEach((change) => change.addedNodes.forEach((node) => node.tagName === "LI" && add(node))))
    .observe(results, { childList: true, subtree: true });
});
