// Entry point of the page of a study.
import "./study.css";
import type { ReportData } from "../data";
import { buildOptimizationPage } from "./optimization_page";
import { buildSweepPage } from "./sweep_page";

export function buildStudyPage(host: HTMLElement, data: ReportData): void {
  if (data.kind === "optimization") buildOptimizationPage(host, data);
  else buildSweepPage(host, data);
}
