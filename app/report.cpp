#include <fmt/format.h>

#include "commands.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/report/figure.hpp"
#include "grapnel/text/error_text.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace fs = std::filesystem;

int report(const ReportOptions& options) {
  Terminal terminal;
  if (options.index) return code_of(write_index_of(options.folder, options.output, terminal));
  return code_of(write_report_of(options.folder, options.second, options.output, terminal));
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

}  // namespace

int figure(const FigureOptions& options) {
  try {
    if (options.list) return print_offers(options.folder);
    if (options.what.empty()) {
      to_stderr("grapnel: error: figure needs --what; --list prints the figures that the folder offers\n");
      return kBadInput;
    }
    Terminal terminal;
    return code_of(draw_figure(request_of(options), options.output, terminal));
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kBadInput;
  }
}

}  // namespace grapnel::app
