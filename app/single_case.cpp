#include "single_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "commands.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "output_folder.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace fs = std::filesystem;

namespace {

// Beyond this the values drawn are in the file only.
constexpr std::size_t kMostListed = 40;

// What the campaign's own files call a case.
const char* word_of(const Campaign& campaign) { return campaign.kind == CampaignKind::sweep ? "point" : "case"; }

std::string comment_of(const Campaign& campaign, std::uint64_t k) {
  const bool sweep = campaign.kind == CampaignKind::sweep;
  std::string text =
      fmt::format("Made by grapnel {} {} from {} (sha256 {}): {} {}", GRAPNEL_VERSION, sweep ? "sweep" : "campaign",
                  fs::path(campaign.file).filename().string(), campaign.sha256.substr(0, 12), word_of(campaign), k);
  if (sweep) {
    text += fmt::format(" of {}.\n", campaign.total());
    const std::vector<std::size_t> position = campaign.position(k);
    for (std::size_t a = 0; a < position.size(); ++a) {
      const StudyAxis& axis = campaign.design[a];
      const AxisValue& value = axis.values[position[a]];
      text += axis.is_numeric
                  ? fmt::format("  {}: {}{}\n", axis.name, value.number, axis.unit.empty() ? "" : " " + axis.unit)
                  : fmt::format("  {}: {}\n", axis.name, value.label);
    }
    return text;
  }
  text += fmt::format(", seed {}.\n", campaign.seed);
  const std::vector<double> drawn = campaign.draw(k);
  for (std::size_t i = 0; i < std::min(drawn.size(), kMostListed); ++i) {
    const CampaignInput& input = campaign.inputs[i];
    text += fmt::format("  {}: {}{}\n", input.name, drawn[i],
                        input.unit.empty() || input.unit == "1" ? "" : " " + input.unit);
  }
  return text;
}

}  // namespace

int run_case_completely(const Campaign& campaign, std::uint64_t k, const fs::path& folder,
                        const RunSwitches& switches) {
  const fs::path file = folder / "scenario.yaml";
  if (!may_replace(file)) return kBadInput;
  CaptureProblem problem;
  try {
    write_file_atomically(file, campaign.scenario_text(k, file, comment_of(campaign, k)));
    problem = load_scenario(file);
  } catch (const InputError& error) {
    say_faults(error.faults());
    return kBadInput;
  } catch (const std::exception& error) {
    to_stderr("{}: error: {} {}: {}\n", campaign.file, word_of(campaign), k, error.what());
    return kBadInput;
  }
  if (!switches.quiet) {
    to_stdout("grapnel {}, {} {} of {} {} as scenario {} (sha256 {})\n\n", GRAPNEL_VERSION, word_of(campaign), k,
              campaign.kind == CampaignKind::sweep ? "study" : "campaign", campaign.file, file.string(),
              problem.sha256.substr(0, 12));
    flush_stdout();
  }
  return run_problem(problem, file, folder, switches);
}

int only_case(const Campaign& campaign, std::uint64_t k, const fs::path& asked, const RunSwitches& switches) {
  // Beyond a campaign's own cases are those of --extend; a design has none.
  if (!campaign.design.empty() && k >= campaign.total()) {
    to_stderr("{0}: error: there is no {1} {2}: the {3} has {1}s 0 to {4}\n", campaign.file, word_of(campaign), k,
              campaign.kind == CampaignKind::sweep ? "study" : "campaign", campaign.total() - 1);
    return kBadInput;
  }
  const fs::path file = campaign.file;
  const std::optional<fs::path> folder = results_folder(
      asked.empty() ? fs::path("out") / fmt::format("{}-{}-{}", file.stem().string(), word_of(campaign), k) : asked,
      file);
  return folder ? run_case_completely(campaign, k, *folder, switches) : kBadInput;
}

}  // namespace grapnel::app
