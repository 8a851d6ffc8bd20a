#pragma once

/// @file
/// A campaign on the ranks of an MPI job.

#include "commands.hpp"
#include "mpi_messages.hpp"

namespace grapnel::app {

/// `grapnel campaign` by all ranks: rank 0 hands out blocks, the others compute and write them, rank 0 writes the
/// results. A job of one rank does it all by itself. Returns the exit code of this rank.
int mpi_campaign(const CampaignRunOptions& options, const World& world);

}  // namespace grapnel::app
