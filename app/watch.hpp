#pragma once

/// @file
/// --watch: a live page of work in progress, on the loopback interface.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/campaign/listener.hpp"
#include "grapnel/report/report_html.hpp"
#include "grapnel/result/time_series.hpp"
#include "loopback_server.hpp"

namespace grapnel::app {

/// Shows the work of a command on a live page, and passes everything on to another listener.
class Watch : public Listener {
 public:
  struct Work {
    std::string command, title;    // "campaign", "detumbling"
    std::filesystem::path folder;  // of the results
    std::stop_source stop;         // of the page's button
  };
  /// Starts the server. `next` outlives this. @throws std::runtime_error if there is no port or no viewer.
  Watch(Work work, Listener& next);

  const std::string& address() const { return server_->address(); }

  void message(const Message& message) override;
  void note(const std::string& lines) override;
  void phase(const std::string& phase, double at, double end) override;
  void points(const CaseProgress& at) override;
  void cases(const CaseProgress& at) override;
  void samples(const TimeSeries& block) override;

  /// The page learns how the work ended. Waits until an open page has loaded the report: at most 15 s for its request,
  /// and two minutes for the transfer.
  void finish(Ending ending);

 private:
  using Clock = std::chrono::steady_clock;
  struct Phase {
    std::string name;
    double from, at, end;  // [s] of the simulation; of planning: evaluations
    double begun, latest;  // [s] since the start of the command
  };
  struct Count {
    double elapsed;
    CaseProgress at;
  };

  LoopbackServer::Response respond(const LoopbackServer::Request& request);
  bool has_report() const;  // of the ended work
  void delivered();
  std::string state() const;
  std::string page() const;
  void count(const CaseProgress& at, const char* unit);
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  const Work work_;
  const std::optional<std::filesystem::file_time_type> earlier_report_;  // of earlier work
  Listener& next_;
  const Clock::time_point begin_ = Clock::now();

  mutable std::mutex mutex_;  // guards all that follows
  std::condition_variable changed_;
  std::vector<Phase> phases_;
  std::vector<Message> messages_;
  std::string notes_;
  std::string unit_;             // "case", "point"; empty: a single run
  std::vector<Count> history_;   // thinned; the last is the latest
  double count_interval_ = 0.2;  // between entries of the history [s]
  TimeSeries series_;            // every `stride_`-th sample
  std::uint64_t samples_ = 0, stride_ = 1;
  std::optional<Ending> ending_;
  std::optional<Clock::time_point> asked_;  // latest request of a page
  bool sending_ = false;                    // the report, to a page
  bool delivered_ = false;                  // a page knows the ending, and has the report if there is one

  std::unique_ptr<LoopbackServer> server_;  // last: its thread uses the rest
};

/// Runs `work` with the terminal's listener, or with `--watch` with a live page, whose address is printed first.
Ending watched(bool watch, const Watch::Work& about, Listener& terminal, const std::function<Ending(Listener&)>& work);

}  // namespace grapnel::app
