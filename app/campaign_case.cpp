#include "campaign_case.hpp"

#include <fmt/format.h>

#include "single_case.hpp"

namespace grapnel::app {
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
