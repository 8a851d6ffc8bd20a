#include <fmt/format.h>

#include <stdexcept>

#include "commands.hpp"
#include "grapnel/report/figure.hpp"
#include "grapnel/text/error_text.hpp"
#include "output_folder.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace fs = std::filesystem;

namespace {

// Removes a trailing slash: "out/x/" becomes out/x.
fs::path trimmed(const fs::path& folder) { return folder.has_filename() ? folder : folder.parent_path(); }

fs::path default_file(const ReportOptions& options) {
  if (options.second.empty()) return options.folder / "report.html";
  const fs::path other = trimmed(fs::absolute(options.second).lexically_normal());
  return options.folder / fmt::format("report-vs-{}.html", other.filename().string());
}

}  // namespace

int report(const ReportOptions& options) {
  if (const std::string why = why_no_reports(); !why.empty()) {
    to_stderr("grapnel: error: no report: {}\n", why);
    return kSimulationFailed;
  }
  const fs::path folder = trimmed(options.folder),
                 file = options.output.empty() ? default_file(options) : options.output;
  for (const fs::path& read : {folder, options.second}) {
    if (!read.empty()) note_results(read);
  }
  if (!may_write({file})) return kBadInput;
  ReportData data;
  try {
    data = options.second.empty() ? report_data(folder, GRAPNEL_VERSION)
                                  : comparison_data(folder, trimmed(options.second), GRAPNEL_VERSION);
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kBadInput;
  }
  try {
    if (file.has_parent_path()) fs::create_directories(file.parent_path());
    write_report_file(data, file);
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kSimulationFailed;
  }
  to_stdout("{}\n", file.string());
  return kDone;
}

namespace {

int print_offers(const fs::path& folder) {
  for (const FigureOffer& offer : figure_offers(folder)) to_stdout("{:<12} {}\n", offer.what, offer.about);
  return kDone;
}

FigureRequest request_of(const FigureOptions& options) {
  FigureRequest request;
  request.folder = options.folder;
  request.what = options.what;
  request.width = options.width, request.height = options.height;
  request.phases = options.phases;
  if (options.from) request.from = *options.from;
  if (options.to) request.to = *options.to;
  request.instants = options.instants;
  request.times = options.times;
  request.view = options.view;
  request.columns = options.columns;
  request.x_axis = options.x_axis, request.lines_axis = options.lines_axis;
  request.heat_map = options.heat_map;
  request.command = options.command;
  return request;
}

int draw(const FigureOptions& options) {
  const fs::path image = options.output.empty() ? options.folder / "figures" / (options.what + ".pdf") : options.output;
  note_results(options.folder);
  const FigureFiles planned = figure_files(image);
  if (!may_write({planned.image, planned.data, planned.script})) return kBadInput;
  const Figure figure = make_figure(request_of(options));
  const fs::path folder = image.has_parent_path() ? image.parent_path() : fs::path(".");
  if (!results_folder(folder, image, Outputs::images)) return kBadInput;
  FigureFiles files;
  try {
    files = write_figure(figure, image);
  } catch (const std::invalid_argument&) {  // the request does not match the folder
    throw;
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kSimulationFailed;
  }
  if (!files.drawn) {
    to_stdout("{}\n{}\n", files.data.string(), files.script.string());
    to_stderr(
        "grapnel: error: {} is not drawn: gnuplot is missing (on Debian the package gnuplot-nox); its data "
        "and script are written\n",
        files.image.string());
    return kSimulationFailed;
  }
  to_stdout("{}\n{}\n{}\n", files.image.string(), files.data.string(), files.script.string());
  return kDone;
}

}  // namespace

int figure(const FigureOptions& options) {
  try {
    if (options.list) return print_offers(options.folder);
    if (options.what.empty()) {
      to_stderr("grapnel: error: figure needs --what; --list prints the figures that the folder offers\n");
      return kBadInput;
    }
    return draw(options);
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kBadInput;
  }
}

}  // namespace grapnel::app
