// Entry point of a report.
import { start } from "./start";

start(() => null);
