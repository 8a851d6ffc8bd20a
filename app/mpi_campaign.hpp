#pragma once

/// @file
/// A campaign on the ranks of an MPI job.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "commands.hpp"

namespace grapnel {

// Plain messages between ranks: the only part that knows MPI. Nothing but init and finalize is collective, so that no
// rank waits for all others.

namespace app {

/// What ranks tell each other.
enum class MessageKind : int {
  // from rank 0
  open,    // numbers: cases of the campaign (the folder is there)
  work,    // numbers: block
  finish,  // no more work
  // to rank 0
  ready,   // numbers: block done or kNoBlock, rows done, successes, not ok
  failed,  // text: why this rank cannot go on
};

struct Message {
  MessageKind kind = MessageKind::finish;
  std::array<std::uint64_t, 4> numbers{};
  std::string text;  // at most kLongest bytes go over
  int from = 0;

  static constexpr std::size_t kLongest = 1000;
};

/// MPI from its beginning to its end.
class World {
 public:
  World(int& argc, char**& argv);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }

  void send(int to, const Message& message) const;
  /// Waits for a message of that rank.
  Message receive(int from) const;
  /// A message of any rank, if one is there.
  std::optional<Message> try_receive() const;
  /// Ends all ranks at once.
  [[noreturn]] void abort(int code) const;

 private:
  int rank_ = 0, size_ = 1;
};

}  // namespace app

namespace app {

/// `grapnel campaign` by all ranks: rank 0 hands out blocks, the others compute and write them, rank 0 writes the
/// results. A job of one rank does it all by itself. Returns the exit code of this rank.
int mpi_campaign(const CampaignRunOptions& options, const World& world);

}  // namespace app

}  // namespace grapnel
