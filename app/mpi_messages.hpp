#pragma once

/// @file
/// Plain messages between ranks: the only part that knows MPI. Nothing but init and finalize is collective, so that no
/// rank waits for all others. Thread safety: the thread that made the World.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace grapnel::app {

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

}  // namespace grapnel::app
