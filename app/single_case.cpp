#include "single_case.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <optional>

#include "commands.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/study/grid.hpp"
#include "output_folder.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace fs = std::filesystem;

int run_single_case(const SingleCase& single, const std::filesystem::path& folder, const RunSwitches& switches) {
  const std::filesystem::path file = folder / "scenario.yaml";
  if (!may_replace(file)) return kBadInput;
  CaptureProblem problem;
  try {
    write_file_atomically(file, single.text(file));
    problem = load_scenario(file);
  } catch (const InputError& error) {
    say_faults(error.faults());
    return kBadInput;
  } catch (const std::exception& error) {
    to_stderr("{}: error: {}: {}\n", single.study.string(), single.what, error.what());
    return kBadInput;
  }
  if (!switches.quiet) {
    to_stdout("grapnel {}, {} of {} {} as scenario {} (sha256 {})\n\n", GRAPNEL_VERSION, single.what, single.of,
              single.study.string(), file.string(), problem.sha256.substr(0, 12));
    flush_stdout();
  }
  return run_problem(problem, file, folder, switches);
}

namespace {

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

namespace {

// Beyond this the values drawn are in the file only.
constexpr std::size_t kMostListed = 40;

std::string comment_of(const Campaign& campaign, std::uint64_t k) {
  std::string text = fmt::format("Made by grapnel {} campaign from {} (sha256 {}): case {}, seed {}.\n",
                                 GRAPNEL_VERSION, std::filesystem::path(campaign.file).filename().string(),
                                 campaign.sha256.substr(0, 12), k, campaign.seed);
  const std::vector<double> drawn = campaign.draw(k);
  for (std::size_t i = 0; i < std::min(drawn.size(), kMostListed); ++i) {
    const CampaignInput& input = campaign.inputs[i];
    text += fmt::format("  {}: {}{}\n", input.name, drawn[i],
                        input.unit.empty() || input.unit == "1" ? "" : " " + input.unit);
  }
  return text;
}

}  // namespace

int run_case_completely(const Campaign& campaign, std::uint64_t k, const std::filesystem::path& folder,
                        const RunSwitches& switches) {
  const SingleCase single{
      fmt::format("case {}", k), "campaign", campaign.file,
      [&](const std::filesystem::path& place) { return campaign.scenario_text(k, place, comment_of(campaign, k)); }};
  return run_single_case(single, folder, switches);
}

}  // namespace grapnel::app
