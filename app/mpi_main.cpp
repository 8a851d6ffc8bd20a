#include <fmt/format.h>

#include "campaign_arguments.hpp"
#include "mpi_campaign.hpp"
#include "process.hpp"
#include "terminal.hpp"

// Argument parsing only, by every rank; the first one prints.
int main(int argc, char** argv) {
  using namespace grapnel::app;
  prepare_process();
  const World world(argc, argv);
  CLI::App app{"Grapnel's campaigns on the ranks of an MPI job"};
  app.name("grapnel-mpi");
  app.require_subcommand(1);
  app.set_version_flag("--version", "grapnel-mpi " GRAPNEL_VERSION);
  int code = kDone;

  CampaignRunOptions options;
  options.command = fmt::format("mpirun -np {} {}", world.size(), command_line("grapnel-mpi", argc, argv));
  options.resume =
      fmt::format("mpirun -np {} {}", world.size(), command_line_without("grapnel-mpi", argc, argv, "--extend"));
  CLI::App* campaign_command =
      app.add_subcommand("campaign", "As grapnel campaign; rank 0 hands out the work, and the others do it");
  add_campaign_arguments(*campaign_command, options);
  campaign_command->callback([&] { code = mpi_campaign(options, world); });
  CLI::App* map_command = app.add_subcommand("map", "As grapnel map");
  map_command->alias("envelope");  // as it was called
  add_campaign_arguments(*map_command, options);
  map_command->callback([&] {
    options.map = true;
    code = mpi_campaign(options, world);
  });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (world.rank() != 0) return error.get_exit_code() == 0 ? kDone : kBadInput;
    return end_of_parsing(app, error);
  } catch (const std::exception& error) {
    // The other ranks may wait for this one.
    to_stderr("grapnel: error: {}\n", error.what());
    world.abort(kSimulationFailed);
  }
  return code;
}
