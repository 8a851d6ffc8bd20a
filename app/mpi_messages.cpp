#include "mpi_messages.hpp"

#include <mpi.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace grapnel::app {
namespace {

constexpr int kTag = 7;

// A message's bytes: kind, numbers, text. Ranks run the same program on machines of one kind.
struct Wire {
  std::int64_t kind;
  std::array<std::uint64_t, 4> numbers;
  std::array<char, Message::kLongest + 1> text;
};

MPI_Comm world() {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"  // in MPI's macros
  return MPI_COMM_WORLD;
#pragma GCC diagnostic pop
}

MPI_Datatype bytes() {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
  return MPI_BYTE;
#pragma GCC diagnostic pop
}

Message take(int from) {
  Wire wire{};
  MPI_Status status;
  MPI_Recv(&wire, sizeof wire, bytes(), from, kTag, world(), &status);
  Message message;
  message.kind = static_cast<MessageKind>(wire.kind);
  message.numbers = wire.numbers;
  message.text = wire.text.data();
  message.from = status.MPI_SOURCE;
  return message;
}

}  // namespace

World::World(int& argc, char**& argv) {
  // The heartbeat of a folder's lock is a thread of its own, which sends nothing.
  int provided = 0;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_rank(world(), &rank_);
  MPI_Comm_size(world(), &size_);
}

World::~World() { MPI_Finalize(); }

void World::send(int to, const Message& message) const {
  Wire wire{};
  wire.kind = static_cast<std::int64_t>(message.kind);
  wire.numbers = message.numbers;
  std::memcpy(wire.text.data(), message.text.data(), std::min(message.text.size(), Message::kLongest));
  MPI_Send(&wire, sizeof wire, bytes(), to, kTag, world());
}

Message World::receive(int from) const { return take(from); }

std::optional<Message> World::try_receive() const {
  int there = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, kTag, world(), &there, &status);
  if (there == 0) return std::nullopt;
  return take(status.MPI_SOURCE);
}

void World::abort(int code) const {
  MPI_Abort(world(), code);
  std::_Exit(code);
}

}  // namespace grapnel::app
