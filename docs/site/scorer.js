// Order of search results: pages of docs/ first, then scenarios, then the references of C++ and Python.
var Scorer = {
  score: ([name, , anchor, description, score]) => {
    if (/^(cpp\/|python-reference)/.test(name)) return score - 100;
    if (/^(scenarios\/|changelog)/.test(name)) return score - 30;
    if (/^how-to\//.test(name)) return score + 4; // an answer before its background
    return score;
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
