#include "sweep_point.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <optional>

#include "grapnel/study/grid.hpp"
#include "output_folder.hpp"
#include "single_case.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

std::string comment_of(const Study& study, const std::vector<std::size_t>& position, std::size_t point,
                       std::size_t points) {
  std::string text = fmt::format("Made by grapnel {} sweep from {} (sha256 {}): point {} of {}.\n", GRAPNEL_VERSION,
                                 fs::path(study.file).filename().string(), study.sha256.substr(0, 12), point, points);
  for (std::size_t a = 0; a < study.axes.size(); ++a) {
    const StudyAxis& axis = study.axes[a];
    const AxisValue& value = axis.values[position[a]];
    text += axis.is_numeric
                ? fmt::format("  {}: {}{}\n", axis.name, value.number, axis.unit.empty() ? "" : " " + axis.unit)
                : fmt::format("  {}: {}\n", axis.name, value.label);
  }
  return text;
}

}  // namespace

int sweep_point(const Study& study, std::size_t point, std::size_t points, const SweepOptions& options) {
  if (point >= points) {
    to_stderr("{}: error: there is no point {}: the study has points 0 to {}\n", options.study.string(), point,
              points - 1);
    return kBadInput;
  }
  const fs::path asked = options.output.empty()
                             ? fs::path("out") / fmt::format("{}-point-{}", options.study.stem().string(), point)
                             : options.output;
  const std::optional<fs::path> folder = results_folder(asked, options.study);
  if (!folder) return kBadInput;
  const std::vector<std::size_t> position = grid_position(study.axis_sizes(), point);
  const SingleCase single{fmt::format("point {}", point), "study", options.study, [&](const fs::path& place) {
                            return study.scenario_text(position, place, comment_of(study, position, point, points));
                          }};
  return run_single_case(single, *folder, {options.quiet, options.no_report});
}

}  // namespace grapnel::app
