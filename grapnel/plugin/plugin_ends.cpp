#include "grapnel/plugin/plugin_ends.hpp"

#include <algorithm>
#include <exception>
#include <mutex>
#include <utility>

namespace grapnel {
namespace {

thread_local LatePluginEnds* t_late = nullptr;

std::mutex faults_mutex;
std::vector<std::string> faults;  // guarded by faults_mutex

void run_end(const std::function<void()>& end) {
  try {
    end();
  } catch (const std::exception& error) {
    const std::lock_guard lock(faults_mutex);
    // In a campaign every case has the same error; keep one.
    if (std::find(faults.begin(), faults.end(), error.what()) == faults.end()) faults.emplace_back(error.what());
  }
}

}  // namespace

LatePluginEnds::LatePluginEnds() : outer_(t_late) { t_late = this; }

LatePluginEnds::~LatePluginEnds() {
  t_late = outer_;
  finish();
}

void LatePluginEnds::finish() {
  for (const auto& end : std::exchange(ends_, {})) run_end(end);
}

void end_late_plugins() {
  for (LatePluginEnds* late = t_late; late != nullptr; late = late->outer_) late->finish();
}

void end_plugin(std::function<void()> end) {
  if (t_late != nullptr)
    t_late->ends_.push_back(std::move(end));
  else
    run_end(end);
}

std::vector<std::string> take_plugin_faults() {
  const std::lock_guard lock(faults_mutex);
  return std::exchange(faults, {});
}

}  // namespace grapnel
