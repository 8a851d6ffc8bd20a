// Runs every benchmark several times in mixed order and prints one line for each: the minimum time, which excludes
// disturbances by other processes, the median, and the ratio to the peak measured in the same run.
// The options of Google Benchmark apply, e.g. --benchmark_filter=forward_dynamics.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "bench/dynamics_bench.hpp"

namespace {

class Table : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& context) override {
    PrintBasicContext(&GetErrorStream(), context);
    return true;
  }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration) continue;
      const std::string name = run.run_name.function_name;
      Line& line = lines_[name];
      // A workload of many cases may report its own time per case.
      const auto own = run.counters.find("microseconds");
      line.microseconds.push_back(own != run.counters.end()
                                      ? static_cast<double>(own->second)
                                      : 1e6 * run.cpu_accumulated_time / static_cast<double>(run.iterations));
      if (const auto flops = run.counters.find("flops"); flops != run.counters.end()) line.flops = flops->second;
      if (const auto bytes = run.counters.find("bytes"); bytes != run.counters.end()) line.bytes = bytes->second;
    }
  }
  void Finalize() override {
    fmt::print("{:<32}{:>10}{:>10}{:>9}{:>9}{:>18}\n", "", "least us", "median us", "flops", "Gflop/s",
               "share of MuJoCo's");
    for (const auto& [name, line] : lines_) {
      std::string text = fmt::format("{:<32}{:>10.3f}{:>10.3f}", name, line.least(), line.median());
      text += line.flops > 0 ? fmt::format("{:>9.0f}{:>9.2f}", line.flops, 1e-3 * line.flops / line.least())
                             : std::string(18, ' ');
      if (line.bytes > 0) text += fmt::format("{:>11.1f} GB/s", 1e-3 * line.bytes / line.least());
      if (const auto peer = lines_.find("mujoco:" + without_set(name)); peer != lines_.end()) {
        text += fmt::format("{:>18.3f}", line.least() / peer->second.least());
      }
      fmt::print("{}\n", text);
    }
  }

 private:
  // The function that lanes compute: "f/a" for "f@avx2/a".
  static std::string without_set(const std::string& name) {
    const std::size_t at = name.find('@');
    return at == std::string::npos ? name : name.substr(0, at) + name.substr(name.find('/'));
  }
  struct Line {
    std::vector<double> microseconds;  // per repetition
    double flops = 0, bytes = 0;
    double least() const { return *std::min_element(microseconds.begin(), microseconds.end()); }
    double median() const {
      std::vector<double> sorted = microseconds;
      std::sort(sorted.begin(), sorted.end());
      return sorted[sorted.size() / 2];
    }
  };
  // Sorted by function: Grapnel before other engines, small workloads before large ones (chain7 before chain14).
  struct Order {
    bool operator()(const std::string& x, const std::string& y) const { return key(x) < key(y); }
    static std::tuple<bool, std::string, std::size_t, std::string> key(const std::string& name) {
      return {name.find(':') != std::string::npos, name.substr(0, name.find('/')), name.size(), name};
    }
  };

  std::map<std::string, Line, Order> lines_;
};

bool given(int argc, char** argv, std::string_view option) {
  return std::any_of(argv, argv + argc,
                     [&](const char* argument) { return std::string_view(argument).starts_with(option); });
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<char*> arguments(argv, argv + argc);
  // Defaults. The order is mixed so that a slow period of the machine does not affect a single benchmark.
  std::string mixed = "--benchmark_enable_random_interleaving=true";
  std::string repetitions = "--benchmark_repetitions=20";
  std::string minimum_time = "--benchmark_min_time=0.02";
  if (!given(argc, argv, "--benchmark_enable_random_interleaving")) arguments.push_back(mixed.data());
  if (!given(argc, argv, "--benchmark_repetitions")) arguments.push_back(repetitions.data());
  if (!given(argc, argv, "--benchmark_min_time")) arguments.push_back(minimum_time.data());
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) return 2;
  grapnel::bench::register_dynamics();
  grapnel::bench::register_peak();
  grapnel::bench::register_lanes();
  grapnel::bench::register_loops();
  grapnel::bench::register_impacts();
  grapnel::bench::register_contact();
  grapnel::bench::register_plan();
  grapnel::bench::register_capture();
  grapnel::bench::register_campaign();
  grapnel::bench::register_rollouts();
#ifdef GRAPNEL_BENCH_MUJOCO
  grapnel::bench::register_mujoco();
  grapnel::bench::register_mujoco_loops();
  grapnel::bench::register_mujoco_capture();
  grapnel::bench::register_mujoco_rollouts();
  grapnel::bench::register_contact_precision();
  grapnel::bench::register_contact_watch();
#endif
  Table table;
  benchmark::RunSpecifiedBenchmarks(&table);
  return 0;
}
