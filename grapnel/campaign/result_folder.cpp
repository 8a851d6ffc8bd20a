#include "grapnel/campaign/result_folder.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "grapnel/report/index_data.hpp"
#include "grapnel/report/report_html.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/input_files.hpp"

namespace grapnel {
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
    case Outputs::sensitivities:
      return {folder / "sensitivities.json", folder / "sensitivities.csv"};
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

std::optional<fs::path> results_folder(const fs::path& requested, const fs::path& file, Outputs outputs,
                                       Listener& listener) {
  fs::path folder = requested.empty() ? fs::path("out") / file.stem() : requested;
  const std::string why = cannot_write_to(folder);
  if (!why.empty()) {
    listener.error("grapnel", fmt::format("cannot write results to '{}': {}", folder.string(), why));
    return std::nullopt;
  }
  if (!may_write(files_in(folder, outputs), listener)) return std::nullopt;
  for (const char* made_anew : {"series", "shards"}) {
    if (outputs != Outputs::campaign) break;
    const fs::path input = input_below(folder / made_anew);
    if (input.empty()) continue;
    listener.error(input.string(),
                   "is an input of this command, which would replace it; choose another folder with -o");
    return std::nullopt;
  }
  return folder;
}

bool may_write(const std::vector<fs::path>& files, Listener& listener) {
  bool may = true;
  for (const fs::path& file : files) {
    const std::string why = why_not_replace(file);
    if (why.empty()) continue;
    listener.error(file.string(), fmt::format("must not be replaced: {}; choose another name with -o", why));
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

bool holds_no_others(const fs::path& folder, const std::string& name, const std::string& sha256, Listener& listener) {
  const auto refuse = [&](const std::string& whose) {
    listener.error(
        "grapnel",
        fmt::format("'{}' holds the results of {}; replace them with --force, or choose another folder with -o",
                    folder.string(), whose));
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

bool may_replace(const std::filesystem::path& file, Listener& listener) {
  constexpr std::string_view kMade = "# Made by grapnel";
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return true;
  std::string first;
  if (std::filesystem::is_regular_file(file, error)) {
    std::ifstream stream(file, std::ios::binary);
    std::getline(stream, first);
  }
  if (const std::string why = why_not_replace(file); !why.empty()) {
    listener.error(file.string(), fmt::format("must not be replaced: {}; choose another folder with -o", why));
    return false;
  }
  if (first.starts_with(kMade)) return true;
  listener.error(file.string(), "already exists, and grapnel did not make it; choose another folder with -o");
  return false;
}

std::string why_no_reports() {
  if (!embedded_viewer().empty()) return {};
  return "this grapnel was built without Node.js; with Node.js 18 or later and npm, configure with -DGRAPNEL_WEB=ON "
         "and build again";
}

namespace {

void write_report_file(const ReportData& data, const fs::path& file, Listener& listener) {
  const std::size_t bytes = write_report(data, file);
  if (bytes > kLargeReport)
    listener.warning(file.string(),
                     fmt::format("the report has {:.0f} MB and opens slowly", static_cast<double>(bytes) / 1e6));
}

}  // namespace

FolderReport write_folder_report(const fs::path& folder, ResultKind kind, bool no_report, Listener& listener) {
  const fs::path file = folder / "report.html";
  std::error_code ignored;
  try {
    const std::string why_none = why_no_reports();
    if (no_report || !why_none.empty()) {
      fs::remove(file);  // of earlier results
      return {no_report ? "" : fmt::format("no report: {}\n", why_none)};
    }
    write_report_file(report_data(folder, GRAPNEL_VERSION, kind), file, listener);
    return {fmt::format("report: {}\n", file.string())};
  } catch (const TooLarge& error) {
    fs::remove(file, ignored);
    listener.warning("grapnel", "no report: " + error_text(error));
    return {};
  } catch (const std::exception& error) {
    fs::remove(file, ignored);
    listener.error("grapnel", "no report: " + error_text(error));
    return {"", true};
  }
}

namespace {

// Removes a trailing slash: "out/x/" becomes out/x.
fs::path trimmed(const fs::path& folder) { return folder.has_filename() ? folder : folder.parent_path(); }

fs::path report_file(const fs::path& folder, const fs::path& second) {
  if (second.empty()) return folder / "report.html";
  const fs::path other = trimmed(fs::absolute(second).lexically_normal());
  return folder / fmt::format("report-vs-{}.html", other.filename().string());
}

// Passes the exception's text on. Returns `ending`.
Ending told(const std::exception& error, Ending ending, Listener& listener) {
  listener.error("grapnel", error_text(error));
  return ending;
}

// Writes the page of the data that `read` returns; exceptions of `read` are errors in the input.
template <class Read>
Ending write_page(const Read& read, const fs::path& file, Listener& listener) {
  if (!may_write({file}, listener)) return Ending::bad_input;
  ReportData data;
  try {
    data = read();
  } catch (const std::exception& error) {
    return told(error, Ending::bad_input, listener);
  }
  try {
    if (file.has_parent_path()) fs::create_directories(file.parent_path());
    write_report_file(data, file, listener);
  } catch (const std::exception& error) {
    return told(error, Ending::failed, listener);
  }
  listener.note(file.string() + "\n");
  return Ending::done;
}

}  // namespace

Ending write_report_of(const fs::path& folder, const fs::path& second, fs::path file, Listener& listener) {
  if (const std::string why = why_no_reports(); !why.empty()) {
    listener.error("grapnel", "no report: " + why);
    return Ending::failed;
  }
  if (file.empty()) file = report_file(folder, second);
  for (const fs::path& read : {trimmed(folder), second}) {
    if (!read.empty()) note_results(read);
  }
  return write_page(
      [&] {
        return second.empty() ? report_data(trimmed(folder), GRAPNEL_VERSION)
                              : comparison_data(trimmed(folder), trimmed(second), GRAPNEL_VERSION);
      },
      file, listener);
}

Ending write_index_of(const fs::path& folder, fs::path file, Listener& listener) {
  if (const std::string why = why_no_reports(); !why.empty()) {
    listener.error("grapnel", "no index: " + why);
    return Ending::failed;
  }
  if (file.empty()) file = folder / "index.html";
  return write_page([&] { return index_data(trimmed(folder), file, GRAPNEL_VERSION); }, file, listener);
}

namespace {

// @throws std::exception if the folder cannot be read or does not match the request
Ending draw(const FigureRequest& request, const fs::path& image, Listener& listener) {
  note_results(request.folder);
  const FigureFiles planned = figure_files(image);
  if (!may_write({planned.image, planned.data, planned.script}, listener)) return Ending::bad_input;
  const Figure figure = make_figure(request);
  const fs::path folder = image.has_parent_path() ? image.parent_path() : fs::path(".");
  if (!results_folder(folder, image, Outputs::images, listener)) return Ending::bad_input;
  FigureFiles files;
  try {
    files = write_figure(figure, image);
  } catch (const std::invalid_argument&) {  // the request does not match the folder
    throw;
  } catch (const std::exception& error) {
    return told(error, Ending::failed, listener);
  }
  if (!files.drawn) {
    listener.note(fmt::format("{}\n{}\n", files.data.string(), files.script.string()));
    listener.error("grapnel",
                   fmt::format("{} is not drawn: gnuplot is missing (on Debian the package gnuplot-nox); its "
                               "data and script are written",
                               files.image.string()));
    return Ending::failed;
  }
  listener.note(fmt::format("{}\n{}\n{}\n", files.image.string(), files.data.string(), files.script.string()));
  return Ending::done;
}

}  // namespace

Ending draw_figure(const FigureRequest& request, fs::path image, Listener& listener) {
  try {
    if (image.empty()) image = request.folder / "figures" / (request.what + ".pdf");
    return draw(request, image, listener);
  } catch (const std::exception& error) {
    return told(error, Ending::bad_input, listener);
  }
}

}  // namespace grapnel
