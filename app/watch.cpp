#include "watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/report/report_data.hpp"
#include "grapnel/report/run_data.hpp"
#include "grapnel/result/json_document.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostSamples = 2000, kMostCounts = 1000, kMostMessages = 200, kMostNotes = 100'000;
constexpr std::chrono::seconds kOpen{3};                       // a page that has asked within this time is open
constexpr std::chrono::seconds kDelivery{15}, kTransfer{120};  // request and transfer of the report

const char* word_of(Ending ending) {
  switch (ending) {
    case Ending::done:
      return "done";
    case Ending::failed:
      return "failed";
    case Ending::bad_input:
      return "bad input";
    case Ending::some_failed:
      return "some cases failed";
    case Ending::interrupted:
      return "stopped";
  }
  return "ended";
}

const char* word_of(Message::Kind kind) {
  return kind == Message::Kind::error ? "error" : kind == Message::Kind::warning ? "warning" : "remark";
}

// Removes every second sample.
void halve(TimeSeries& series) {
  const std::size_t count = series.time.size();
  const auto thin = [count](auto& values, std::size_t width) {
    for (std::size_t to = 0, from = 0; from < count; ++to, from += 2)
      std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(from * width), width,
                  values.begin() + static_cast<std::ptrdiff_t>(to * width));
    values.resize((count + 1) / 2 * width);
  };
  thin(series.time, 1), thin(series.phase, 1);
  for (Series& one : series.series) thin(one.data, one.components.size());
}

void append_last(const TimeSeries& block, TimeSeries& series) {
  if (series.series.size() != block.series.size()) {
    series = block;
    drop_samples(series);
  }
  series.phases = block.phases;
  series.time.push_back(block.time.back());
  series.phase.push_back(block.phase.back());
  for (std::size_t i = 0; i < block.series.size(); ++i) {
    const std::vector<double>& data = block.series[i].data;
    series.series[i].data.insert(series.series[i].data.end(),
                                 data.end() - static_cast<std::ptrdiff_t>(block.series[i].components.size()),
                                 data.end());
  }
}

// Empty: there is no such file.
std::optional<fs::file_time_type> time_of(const fs::path& file) {
  std::error_code none;
  const fs::file_time_type time = fs::last_write_time(file, none);
  return none ? std::nullopt : std::optional(time);
}

}  // namespace

Watch::Watch(Work work, Listener& next)
    : work_(std::move(work)), earlier_report_(time_of(work_.folder / "report.html")), next_(next) {
  if (const std::string fault = why_no_reports(); !fault.empty()) throw std::runtime_error(fault);
  server_ =
      std::make_unique<LoopbackServer>([this](const LoopbackServer::Request& request) { return respond(request); });
}

void Watch::message(const Message& message) {
  {
    const std::lock_guard lock(mutex_);
    if (messages_.size() < kMostMessages || message.kind == Message::Kind::error) messages_.push_back(message);
  }
  next_.message(message);
}

void Watch::note(const std::string& lines) {
  {
    const std::lock_guard lock(mutex_);
    if (notes_.size() < kMostNotes) notes_ += lines;
  }
  next_.note(lines);
}

void Watch::phase(const std::string& phase, double at, double end) {
  {
    const std::lock_guard lock(mutex_);
    const double now = elapsed();
    if (phases_.empty() || phases_.back().name != phase) phases_.push_back({phase, at, at, end, now, now});
    phases_.back().at = at, phases_.back().end = end, phases_.back().latest = now;
  }
  next_.phase(phase, at, end);
}

void Watch::points(const CaseProgress& at) {
  count(at, "point");
  next_.points(at);
}

void Watch::cases(const CaseProgress& at) {
  count(at, "case");
  next_.cases(at);
}

void Watch::count(const CaseProgress& at, const char* unit) {
  const std::lock_guard lock(mutex_);
  unit_ = unit;
  const double now = elapsed();
  const std::size_t n = history_.size();
  // The latest entry moves until it is old enough.
  if (n >= 2 && now - history_[n - 2].elapsed < count_interval_) history_.pop_back();
  history_.push_back({now, at});
  if (history_.size() <= kMostCounts) return;
  std::size_t to = 0;
  for (std::size_t from = 0; from < history_.size(); from += 2) history_[to++] = history_[from];
  history_.resize(to);
  count_interval_ *= 2;
}

void Watch::samples(const TimeSeries& block) {
  {
    const std::lock_guard lock(mutex_);
    if (samples_++ % stride_ == 0) append_last(block, series_);
    if (series_.time.size() >= kMostSamples) halve(series_), stride_ *= 2;
  }
  next_.samples(block);
}

bool Watch::has_report() const {
  const auto time = time_of(work_.folder / "report.html");
  return ending_ && time && time != earlier_report_;
}

std::string Watch::state() const {
  Json phases = Json::array(), messages = Json::array(), history = Json::array();
  for (const Phase& one : phases_) {
    phases.push_back({{"name", one.name},
                      {"from", one.from},
                      {"at", one.at},
                      {"end", one.end},
                      {"begun", one.begun},
                      {"latest", one.latest},
                      {"unit", one.name == kPlanning ? "evaluations" : "s"}});
  }
  for (const Message& one : messages_) messages.push_back({{"kind", word_of(one.kind)}, {"text", one.text}});
  for (const Count& one : history_) history.push_back({one.elapsed, one.at.done, one.at.successes, one.at.not_ok});
  Json state = {{"elapsed", elapsed()},
                {"stopping", work_.stop.stop_requested()},
                {"ending", ending_ ? Json(word_of(*ending_)) : Json()},
                {"report", has_report()},
                {"samples", samples_},
                {"phases", std::move(phases)},
                {"messages", std::move(messages)},
                {"notes", notes_},
                {"unit", unit_},
                {"history", std::move(history)}};
  if (!history_.empty()) state["begun_with"] = history_.back().at.begun_with, state["total"] = history_.back().at.total;
  return state.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string Watch::page() const {
  return report_html(page_data("watch", work_.title, {{"command", work_.command}}, GRAPNEL_VERSION), embedded_viewer(),
                     PageRequests::own_server);
}

LoopbackServer::Response Watch::respond(const LoopbackServer::Request& request) {
  const std::string html = "text/html; charset=utf-8", json = "application/json";
  if (request.is_post) {
    if (request.path != "stop") return {404, "text/plain; charset=utf-8", "not found\n"};
    std::stop_source(work_.stop).request_stop();
    return {200, json, "{}"};
  }
  std::unique_lock lock(mutex_);
  asked_ = Clock::now();
  if (request.path == "state") {
    LoopbackServer::Response made{200, json, state()};
    if (ending_ && !has_report()) made.sent = [this] { delivered(); };
    return made;
  }
  if (request.path == "series") {
    const TimeSeries copy = series_;
    lock.unlock();
    return {200, json, packed_series(copy).dump(-1, ' ', false, Json::error_handler_t::replace)};
  }
  if (!request.path.empty()) return {404, "text/plain; charset=utf-8", "not found\n"};
  if (!has_report()) return {200, html, page()};
  sending_ = true;
  return {200, html, file_bytes(work_.folder / "report.html"), [this] { delivered(); }};
}

void Watch::delivered() {
  const std::lock_guard lock(mutex_);
  delivered_ = true;
  changed_.notify_all();
}

void Watch::finish(Ending ending) {
  std::unique_lock lock(mutex_);
  ending_ = ending;
  const Clock::time_point end = Clock::now();
  const auto waits = [&] {
    const Clock::time_point now = Clock::now();
    if (sending_) return now - end < kTransfer;
    return asked_ && now - *asked_ < kOpen && now - end < kDelivery;
  };
  while (!delivered_ && waits()) changed_.wait_for(lock, std::chrono::milliseconds(100));
}

Ending watched(bool watch, const Watch::Work& about, Listener& terminal, const std::function<Ending(Listener&)>& work) {
  if (!watch) return work(terminal);
  std::unique_ptr<Watch> live;
  try {
    live = std::make_unique<Watch>(about, terminal);
  } catch (const std::runtime_error& error) {
    terminal.error("grapnel", fmt::format("--watch: {}", error.what()));
    return Ending::failed;
  }
  terminal.note(fmt::format("live page: {}\n\n", live->address()));
  try {
    const Ending ending = work(*live);
    live->finish(ending);
    return ending;
  } catch (...) {
    live->finish(Ending::failed);
    throw;
  }
}

}  // namespace grapnel::app
