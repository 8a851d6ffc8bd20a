// Starts a report: reads its data, and builds the page for its kind. The page displays all errors.
import "./style.css";
import { buildCampaignPage } from "./campaign/campaign_page";
import type { ReportData } from "./data";
import { element } from "./dom";
import { buildImpulsesPage } from "./impulses_page";
import { buildIndexPage } from "./index_page";
import { buildLogPage } from "./log_page";
import { buildRunPage } from "./page/run_page";
import { buildStudyPage } from "./study/study_page";
import { buildWatchPage } from "./watch/watch_page";
import type { EngineProvider } from "./whatif/engine_interface";

function read(): ReportData {
  const text = document.getElementById("grapnel-data")?.textContent ?? "";
  if (text.trim() === "") throw new Error("the report holds no data");
  let data: ReportData;
  try {
    data = JSON.parse(text);
  } catch (error) {
    throw new Error(`the report's data are damaged: ${(error as Error).message}`);
  }
  if (data.schema !== "grapnel-report/1") throw new Error(`the report's data are of another kind: ${String(data.schema)}`);
  return data;
}

function build(host: HTMLElement, engineOf: EngineProvider): void {
  const data = read();
  document.title = `${data.title} – Grapnel`;
  if (data.kind === "run") buildRunPage(host, data, engineOf(data));
  else if (data.kind === "comparison") buildRunPage(host, data, null);
  else if (data.kind === "campaign") buildCampaignPage(host, data);
  else if (data.kind === "log") buildLogPage(host, data);
  else if (data.kind === "impulses") buildImpulsesPage(host, data);
  else if (data.kind === "watch") buildWatchPage(host, data);
  else if (data.kind === "index") buildIndexPage(host, data);
  else buildStudyPage(host, data);
  skipLink(host);
}

// First in the Tab order: skips head and navigation.
function skipLink(host: HTMLElement): void {
  document.querySelector("body > .skip")?.remove();
  const first = host.querySelector<HTMLElement>("section[id]");
  if (!first) return;
  const link = element("a", { class: "skip", href: `#${first.id}` }, "Skip to the results");
  link.addEventListener("click", (event) => {
    event.preventDefault(); // the address contains the displayed instant
    first.tabIndex = -1;
    first.focus();
  });
  document.body.prepend(link);
}

// `engineOf`: the engine that simulates variants of a run.
export function start(engineOf: EngineProvider): void {
  const host = document.getElementById("report") ?? document.body.appendChild(element("main", { id: "report" }));
  try {
    build(host, engineOf);
  } catch (error) {
    console.warn(error);
    host.replaceChildren(
      element(
        "section",
        { class: "fault", role: "alert" },
        element("h1", {}, "This report cannot be shown"),
        element("p", {}, (error as Error).message),
        element("p", {}, "Make it again from its results: grapnel report DIR"),
      ),
    );
  }
}
