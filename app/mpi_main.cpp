// grapnel-mpi: runs a campaign on the ranks of an MPI job.

#include <fmt/format.h>
#include <mpi.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "campaign_folder.hpp"
#include "commands.hpp"
#include "grapnel/campaign/run_campaign.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/input_files.hpp"
#include "output_folder.hpp"
#include "terminal.hpp"

namespace grapnel {

// Point-to-point messages between ranks: the only part that calls MPI. Only init and finalize are collective, so that
// no rank waits for all others.

namespace app {

/// Kinds of messages between ranks.
enum class MessageKind : int {
  // from rank 0
  open,    // numbers: cases of the campaign (the folder is there)
  work,    // numbers: block
  finish,  // no more work
  // to rank 0
  ready,   // numbers: block done or kNoBlock, rows done, successes, not ok
  failed,  // text: why this rank cannot continue
};

struct Message {
  MessageKind kind = MessageKind::finish;
  std::array<std::uint64_t, 4> numbers{};
  std::string text;  // at most kLongest bytes are sent
  int from = 0;

  static constexpr std::size_t kLongest = 1000;
};

/// MPI from init to finalize.
class World {
 public:
  World(int& argc, char**& argv);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }

  void send(int to, const Message& message) const;
  /// Waits for a message from that rank.
  Message receive(int from) const;
  /// A message of any rank, if one has arrived.
  std::optional<Message> try_receive() const;
  /// Ends all ranks immediately.
  [[noreturn]] void abort(int code) const;

 private:
  int rank_ = 0, size_ = 1;
};

}  // namespace app

namespace app {

/// Runs `grapnel campaign` on all ranks: rank 0 assigns blocks, the others compute and write them, rank 0 writes the
/// results. In a job with one rank, rank 0 computes the blocks itself. Returns the exit code of this rank.
int mpi_campaign(const CampaignRunOptions& options, const World& world);

}  // namespace app

}  // namespace grapnel

namespace grapnel {

namespace app {

namespace {

constexpr int kTag = 7;

// A message's bytes: kind, numbers, text. All ranks run the same program on the same kind of machine.
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
  // The heartbeat of a folder's lock runs in a separate thread, which makes no MPI calls.
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

}  // namespace app

namespace app {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kNoBlock = ~std::uint64_t{0};
constexpr std::chrono::milliseconds kNap{1};  // interval at which rank 0 polls for messages

std::string writer(int rank) { return fmt::format("rank-{}", rank); }

Message message(MessageKind kind, std::array<std::uint64_t, 4> numbers = {}) { return {kind, numbers, {}, 0}; }

// --- Rank 0 ---

// Assigns the missing blocks to ranks, and counts completed ones.
class Foreman {
 public:
  Foreman(const World& world, std::vector<ShardStore::Missing> missing, const CaseProgress& progress)
      : world_(world), waiting_(missing.begin(), missing.end()), progress_(progress) {
    for (int rank = 1; rank < world.size(); ++rank) away_.insert(rank);
  }

  /// Runs until every rank has been dismissed.
  void run(const CampaignRunOptions& options, StopSignal& stop) {
    Progress shown(options.quiet);
    while (!away_.empty()) {
      if (const auto said = world_.try_receive())
        answer(*said, stop.poll());
      else
        std::this_thread::sleep_for(kNap);
      stop.poll();
      shown.report_campaign(progress_);
    }
  }
  const CaseProgress& progress() const { return progress_; }
  const std::string& failure() const { return failure_; }

 private:
  void answer(const Message& said, bool stopping) {
    if (said.kind == MessageKind::failed) {
      if (failure_.empty()) failure_ = fmt::format("rank {}: {}", said.from, said.text);
      away_.erase(said.from);
      return;
    }
    progress_.done += said.numbers[1];
    progress_.successes += said.numbers[2];
    progress_.not_ok += said.numbers[3];
    if (stopping || waiting_.empty() || !failure_.empty()) {
      world_.send(said.from, message(MessageKind::finish));
      away_.erase(said.from);
      return;
    }
    world_.send(said.from, message(MessageKind::work, {waiting_.front().block.number}));
    waiting_.pop_front();
  }

  const World& world_;
  std::deque<ShardStore::Missing> waiting_;
  std::set<int> away_;  // ranks that are computing
  CaseProgress progress_;
  std::string failure_;
};

// Dismisses ranks that wait for the folder.
void send_home(const World& world) {
  for (int rank = 1; rank < world.size(); ++rank) world.send(rank, message(MessageKind::finish));
}

CaseProgress compute_alone(const Campaign& campaign, ShardStore& store, const CampaignRunOptions& options,
                           StopSignal& stop) {
  Progress shown(options.quiet);
  CampaignOptions run;
  run.stop = stop.token();
  run.progress = [&](const CaseProgress& at) {
    stop.poll();
    shown.report_campaign(at);
  };
  return run_campaign(block_work(campaign), store, run);
}

CaseProgress compute_by_ranks(ShardStore& store, const CampaignRunOptions& options, const World& world,
                              StopSignal& stop, bool& opened) {
  std::vector<ShardStore::Missing> missing;
  const CaseProgress there = progress_of(store, missing);
  opened = true;
  for (int rank = 1; rank < world.size(); ++rank) world.send(rank, message(MessageKind::open, {store.total()}));
  Foreman foreman(world, std::move(missing), there);
  foreman.run(options, stop);
  if (!foreman.failure().empty()) throw std::runtime_error(foreman.failure());
  CaseProgress done = foreman.progress();
  done.stopped = done.done < done.total;
  return done;
}

int lead(Campaign& campaign, const fs::path& folder, const CampaignRunOptions& options, const World& world,
         StopSignal& stop, std::string& command) {
  bool opened = false;
  try {
    ShardStore store(folder, campaign,
                     {.version = GRAPNEL_VERSION, .writer = writer(0), .extend = options.extend, .total = 0});
    take_total(campaign, store);
    command = options.resume;
    if (!options.quiet) print_start(store, fmt::format("{} ranks", world.size()));
    const CaseProgress done = world.size() == 1 ? compute_alone(campaign, store, options, stop)
                                                : compute_by_ranks(store, options, world, stop, opened);
    if (done.stopped) {
      print_stopped(folder, done.done, done.total, options.resume);
      return kInterrupted;
    }
    return write_campaign_results(campaign, folder, {options.quiet, options.no_report, options.no_csv}, stop);
  } catch (...) {
    if (!opened) send_home(world);
    throw;
  }
}

// --- The others ---

// Computes and writes the blocks that rank 0 assigns.
void work(Campaign& campaign, const fs::path& folder, const World& world, StopSignal& stop) {
  ShardStore store(folder, campaign,
                   {.version = GRAPNEL_VERSION, .writer = writer(world.rank()), .extend = 0, .total = 0});
  take_total(campaign, store);
  const BlockWork compute = block_work(campaign);
  std::uint64_t part_size = 1;
  Message report = message(MessageKind::ready, {kNoBlock});
  for (;;) {
    world.send(0, report);
    const Message told = world.receive(0);
    if (told.kind != MessageKind::work) return;
    const Block block = block_at(told.numbers[0], store.block_size(), store.total());
    const ShardStore::Missing missing{block, store.rows(block).size()};
    BlockInProgress on_its_way(store, missing);
    CaseProgress fresh;
    run_block(
        compute, missing, part_size,
        [&](std::vector<CaseRow> rows) {
          stop.poll();
          fresh.count(rows);
          on_its_way.add(std::move(rows));
        },
        stop.token());
    on_its_way.keep();
    report.numbers = {block.number, fresh.done, fresh.successes, fresh.not_ok};
  }
}

// `campaign`: null if this rank could not read it.
int follow(Campaign* campaign, const fs::path& folder, const CampaignRunOptions& options, const World& world,
           StopSignal& stop) {
  if (world.receive(0).kind == MessageKind::finish) return campaign != nullptr ? kDone : kBadInput;
  try {
    if (campaign == nullptr) throw std::runtime_error("cannot read " + options.study.string());
    work(*campaign, folder, world, stop);
    return kDone;
  } catch (const std::exception& error) {
    Message said = message(MessageKind::failed);
    said.text = error_text(error);
    world.send(0, said);
    return kSimulationFailed;
  }
}

}  // namespace

int mpi_campaign(const CampaignRunOptions& options, const World& world) {
  const bool leads = world.rank() == 0;
  // All ranks read the file; rank 0 prints its errors. A rank waits only for rank 0.
  std::optional<Campaign> campaign = campaign_from_file(options, leads);
  const fs::path folder = options.output.empty() ? fs::path("out") / options.study.stem() : options.output;
  StopSignal stop;
  if (!leads) return follow(campaign ? &*campaign : nullptr, folder, options, world, stop);
  if (!campaign || !results_folder(options.output, options.study, Outputs::campaign)) {
    send_home(world);
    return kBadInput;
  }
  print_campaign(*campaign, options);
  std::string command = options.command;  // resumes the campaign
  return with_store_errors(folder, command, [&] { return lead(*campaign, folder, options, world, stop, command); });
}

}  // namespace app

}  // namespace grapnel

// Parses the arguments on every rank; rank 0 prints.
int main(int argc, char** argv) {
  using namespace grapnel::app;
  prepare_process();
  const grapnel::InputFiles inputs;
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
      app.add_subcommand("campaign", "As grapnel campaign; rank 0 assigns the work to the other ranks");
  add_campaign_arguments(*campaign_command, options);
  campaign_command->callback([&] { code = mpi_campaign(options, world); });
  CLI::App* map_command = app.add_subcommand("map", "As grapnel map");
  map_command->alias("envelope");  // former name
  add_campaign_arguments(*map_command, options);
  map_command->callback([&] {
    options.map = true;
    code = mpi_campaign(options, world);
  });

  require_finite_numbers(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (world.rank() != 0) return error.get_exit_code() == 0 ? kDone : kBadInput;
    return end_of_parsing(app, error);
  } catch (const std::exception& error) {
    // The other ranks may be waiting for this one.
    world.abort(unexpected_error(error));
  }
  if (print_plugin_errors() && code == kDone) code = kSimulationFailed;
  return code;
}
