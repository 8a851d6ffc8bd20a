#include "output_folder.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>
#include <system_error>

#include "grapnel/report/report_html.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/input_files.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace fs = std::filesystem;

namespace {

// Makes the folder. Returns why it is not writable, before a long simulation; empty if it is writable.
std::string cannot_write_to(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return error.message();
  return ::access(folder.c_str(), W_OK | X_OK) == 0 ? std::string() : std::strerror(errno);
}

// The files of a result folder, by command; temporary files are renamed at the end.
std::vector<fs::path> files_in(const fs::path& folder, Outputs outputs) {
  std::vector<const char*> names;
  switch (outputs) {
    case Outputs::run:
      names = {"summary.json", "scene.json", "scenario.json", "timeseries.h5"};
      break;
    case Outputs::case_run:
      names = {"scenario.yaml", "summary.json", "scene.json", "scenario.json", "timeseries.h5"};
      break;
    case Outputs::sweep:
      names = {"table.partial.csv", "table.csv", "table.h5", "study.json", "source.json"};
      break;
    case Outputs::campaign:
      names = {"manifest.json", "table.csv", "table.h5", "campaign.json", "success_map.csv", "lock"};
      break;
    case Outputs::optimization:
      names = {"evaluations.csv", "best.yaml", "comparison.json"};
      break;
    case Outputs::images:
      return {};
  }
  std::vector<fs::path> files{folder / "report.html"};
  for (const char* name : names) files.push_back(folder / name);
  return files;
}

struct NamedScenario {
  std::string name, sha256;
};

// The scenario whose run left a summary; empty if there is no readable summary, so that no results are at risk.
std::optional<NamedScenario> scenario_of_results(const fs::path& summary) {
  std::error_code error;
  if (!fs::is_regular_file(summary, error)) return std::nullopt;
  try {
    const nlohmann::json document = nlohmann::json::parse(file_bytes(summary));
    const nlohmann::json& scenario = document.at("scenario");
    return NamedScenario{scenario.at("name").get<std::string>(), scenario.at("sha256").get<std::string>()};
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace

std::optional<fs::path> results_folder(const fs::path& asked, const fs::path& file, Outputs outputs) {
  fs::path folder = asked.empty() ? fs::path("out") / file.stem() : asked;
  const std::string why = cannot_write_to(folder);
  if (!why.empty()) {
    to_stderr("grapnel: error: cannot write results to '{}': {}\n", folder.string(), why);
    return std::nullopt;
  }
  if (!may_write(files_in(folder, outputs))) return std::nullopt;
  for (const char* made_anew : {"series", "shards"}) {
    if (outputs != Outputs::campaign) break;
    const fs::path input = input_below(folder / made_anew);
    if (input.empty()) continue;
    to_stderr("{}: error: is an input of this command, which would replace it; choose another folder with -o\n",
              input.string());
    return std::nullopt;
  }
  return folder;
}

bool may_write(const std::vector<fs::path>& files) {
  bool may = true;
  for (const fs::path& file : files) {
    const std::string why = why_not_replace(file);
    if (why.empty()) continue;
    to_stderr("{}: error: must not be replaced: {}; choose another name with -o\n", file.string(), why);
    may = false;
  }
  return may;
}

void note_results(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return note_input(folder);
  for (const Outputs outputs : {Outputs::case_run, Outputs::sweep, Outputs::campaign, Outputs::optimization}) {
    for (const fs::path& file : files_in(folder, outputs)) {
      if (file.extension() != ".html") note_input(file);  // which no command reads
    }
  }
}

bool holds_no_others(const fs::path& folder, const std::string& name, const std::string& sha256) {
  const auto refuse = [&](const std::string& whose) {
    to_stderr(
        "grapnel: error: '{}' holds the results of {}; replace them with --force, or choose another folder with -o\n",
        folder.string(), whose);
    return false;
  };
  struct Other {
    const char *file, *whose;
  };
  for (const Other& other : {Other{"manifest.json", "a campaign"}, Other{"study.json", "a sweep"},
                             Other{"comparison.json", "an optimization"}}) {
    std::error_code error;
    if (fs::exists(folder / other.file, error)) return refuse(other.whose);
  }
  const std::optional<NamedScenario> there = scenario_of_results(folder / "summary.json");
  if (!there || there->name == name || there->sha256 == sha256) return true;
  return refuse(fmt::format("the scenario '{}'", there->name));
}

bool may_replace(const std::filesystem::path& file) {
  constexpr std::string_view kMade = "# Made by grapnel";
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return true;
  std::string first;
  if (std::filesystem::is_regular_file(file, error)) {
    std::ifstream stream(file, std::ios::binary);
    std::getline(stream, first);
  }
  if (const std::string why = why_not_replace(file); !why.empty()) {
    to_stderr("{}: error: must not be replaced: {}; choose another folder with -o\n", file.string(), why);
    return false;
  }
  if (first.starts_with(kMade)) return true;
  to_stderr("{}: error: already exists, and grapnel did not make it; choose another folder with -o\n", file.string());
  return false;
}

std::string why_no_reports() {
  if (!embedded_viewer().empty()) return {};
  return "this grapnel was built without Node.js; with Node.js 18 or later and npm, configure with -DGRAPNEL_WEB=ON "
         "and build again";
}

void write_report_file(const ReportData& data, const fs::path& file) {
  const std::size_t bytes = write_report(data, file);
  if (bytes <= kLargeReport) return;
  to_stderr("{}: warning: the report has {:.0f} MB and opens slowly\n", file.string(),
            static_cast<double>(bytes) / 1e6);
}

FolderReport write_folder_report(const fs::path& folder, ResultKind kind, bool no_report) {
  const fs::path file = folder / "report.html";
  std::error_code ignored;
  try {
    const std::string why_none = why_no_reports();
    if (no_report || !why_none.empty()) {
      fs::remove(file);  // of earlier results
      return {no_report ? "" : fmt::format("no report: {}\n", why_none)};
    }
    write_report_file(report_data(folder, GRAPNEL_VERSION, kind), file);
    return {fmt::format("report: {}\n", file.string())};
  } catch (const TooLarge& error) {
    fs::remove(file, ignored);
    to_stderr("grapnel: warning: no report: {}\n", error_text(error));
    return {};
  } catch (const std::exception& error) {
    fs::remove(file, ignored);
    to_stderr("grapnel: error: no report: {}\n", error_text(error));
    return {"", true};
  }
}

}  // namespace grapnel::app
