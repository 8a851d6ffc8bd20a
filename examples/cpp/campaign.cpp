// A campaign: the same capture with uncertain targets, in memory and in a folder.
#include <cmath>
#include <iostream>

#include "grapnel/api/campaign.hpp"

namespace {

std::size_t column_named(const grapnel::CampaignOutcome& rows, const std::string& name) {
  for (std::size_t i = 0; i < rows.columns.size(); ++i)
    if (rows.columns[i].name == name) return i;
  throw std::runtime_error("the campaign does not store " + name);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return std::cerr << "usage: campaign CAMPAIGN.yaml FOLDER\n", 2;
  try {
    const grapnel::CampaignOutcome rows = grapnel::simulate_campaign(argv[1]);
    const std::size_t impulse = column_named(rows, "grasps/tip-1/impulse_magnitude");
    double sum = 0, squares = 0;
    for (const grapnel::CampaignCase& one : rows.cases) {
      if (!one.ok) return std::cerr << "case " << one.index << ": " << one.reason << '\n', 1;
      sum += one.values[impulse], squares += one.values[impulse] * one.values[impulse];
    }
    const double n = static_cast<double>(rows.cases.size()), mean = sum / n;
    std::cout << rows.summary.cases << " cases, " << rows.inputs.size() << " uncertain values, impulse of tip-1 "
              << mean << " +- " << std::sqrt(squares / n - mean * mean) << " N s\n";

    // The same in a folder, where a stopped campaign continues; with table.h5, campaign.json and report.html.
    grapnel::CampaignRun run;
    run.progress = [](std::uint64_t done, std::uint64_t total) { std::cerr << done << " of " << total << '\r'; };
    const grapnel::CampaignSummary summary = grapnel::simulate_campaign(argv[1], argv[2], run);
    std::cout << "success: " << summary.probability << ", between " << summary.lower << " and " << summary.upper
              << '\n';
    return summary.stopped ? 1 : 0;
  } catch (const std::exception& error) {
    return std::cerr << error.what() << '\n', 2;
  }
}
