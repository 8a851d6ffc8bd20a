#include "mpi_campaign.hpp"

#include <fmt/format.h>

#include <chrono>
#include <deque>
#include <optional>
#include <set>
#include <thread>

#include "campaign_folder.hpp"
#include "grapnel/campaign/run_campaign.hpp"
#include "output_folder.hpp"
#include "process.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kNoBlock = ~std::uint64_t{0};
constexpr std::chrono::milliseconds kNap{1};  // of rank 0 between looks for messages

std::string writer(int rank) { return fmt::format("rank-{}", rank); }

Message message(MessageKind kind, std::array<std::uint64_t, 4> numbers = {}) { return {kind, numbers, {}, 0}; }

// --- Rank 0 ---

// Hands out the blocks that are missing, and counts what comes back.
class Foreman {
 public:
  Foreman(const World& world, std::vector<ShardStore::Missing> missing, const CampaignProgress& progress)
      : world_(world), waiting_(missing.begin(), missing.end()), progress_(progress) {
    for (int rank = 1; rank < world.size(); ++rank) away_.insert(rank);
  }

  /// Until every rank has been sent home.
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
  const CampaignProgress& progress() const { return progress_; }
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
  std::set<int> away_;  // ranks that work
  CampaignProgress progress_;
  std::string failure_;
};

// Ranks that wait for the folder go home.
void send_home(const World& world) {
  for (int rank = 1; rank < world.size(); ++rank) world.send(rank, message(MessageKind::finish));
}

CampaignProgress begun(const ShardStore& store, std::vector<ShardStore::Missing>& missing) {
  StoreCounts there;
  missing = store.missing(0, 1, &there);
  CampaignProgress progress;
  progress.done = progress.begun_with = there.rows;
  progress.total = store.total();
  progress.successes = there.successes;
  progress.not_ok = there.not_ok;
  return progress;
}

CampaignProgress compute_alone(const Campaign& campaign, ShardStore& store, const CampaignRunOptions& options,
                               StopSignal& stop) {
  Progress shown(options.quiet);
  CampaignOptions run;
  run.stop = stop.token();
  run.progress = [&](const CampaignProgress& at) {
    stop.poll();
    shown.report_campaign(at);
  };
  return run_campaign(block_work(campaign), store, run);
}

CampaignProgress compute_by_ranks(ShardStore& store, const CampaignRunOptions& options, const World& world,
                                  StopSignal& stop, bool& opened) {
  std::vector<ShardStore::Missing> missing;
  const CampaignProgress there = begun(store, missing);
  opened = true;
  for (int rank = 1; rank < world.size(); ++rank) world.send(rank, message(MessageKind::open, {store.total()}));
  Foreman foreman(world, std::move(missing), there);
  foreman.run(options, stop);
  if (!foreman.failure().empty()) throw std::runtime_error(foreman.failure());
  CampaignProgress done = foreman.progress();
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
    if (!options.quiet) say_beginning(store, fmt::format("{} ranks", world.size()));
    const CampaignProgress done = world.size() == 1 ? compute_alone(campaign, store, options, stop)
                                                    : compute_by_ranks(store, options, world, stop, opened);
    if (done.stopped) {
      say_stopped(folder, done.done, done.total, options.resume);
      return kInterrupted;
    }
    return write_campaign_results(campaign, folder, {options.quiet, options.no_report, options.no_csv}, stop);
  } catch (...) {
    if (!opened) send_home(world);
    throw;
  }
}

// --- The others ---

// Computes and writes the blocks that rank 0 names.
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
    report = message(MessageKind::ready, {block.number});
    BlockParts parts;
    parts.fresh = [&](std::span<const CampaignRow> fresh) {
      stop.poll();
      for (const CampaignRow& row : fresh) {
        ++report.numbers[1];
        if (row.success) ++report.numbers[2];
        if (row.status != CaseStatus::ok) ++report.numbers[3];
      }
    };
    parts.worth_keeping = [&](const std::vector<CampaignRow>& so_far) { store.write(block, so_far); };
    std::vector<CampaignRow> rows = store.rows(block);
    const std::size_t there = rows.size();
    rows = run_block(compute, block, std::move(rows), part_size, parts, stop.token());
    if (rows.size() > there) store.write(block, rows);
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
    said.text = error.what();
    world.send(0, said);
    return kSimulationFailed;
  }
}

}  // namespace

int mpi_campaign(const CampaignRunOptions& options, const World& world) {
  const bool leads = world.rank() == 0;
  // All ranks read the file; one says what is wrong with it. None waits for others but for rank 0.
  std::optional<Campaign> campaign = campaign_from_file(options, leads);
  const fs::path folder = options.output.empty() ? fs::path("out") / options.study.stem() : options.output;
  StopSignal stop;
  if (!leads) return follow(campaign ? &*campaign : nullptr, folder, options, world, stop);
  if (!campaign || !results_folder(options.output, options.study)) {
    send_home(world);
    return kBadInput;
  }
  say_campaign(*campaign, options);
  std::string command = options.command;  // that goes on
  return with_store_errors(folder, command, [&] { return lead(*campaign, folder, options, world, stop, command); });
}

}  // namespace grapnel::app
