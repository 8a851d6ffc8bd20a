#include <gtest/gtest.h>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/scenario/scenario.hpp"
namespace grapnel::testing {
TEST(Scratch, Run) {
  const char* paths = std::getenv("SCRATCH");
  if (!paths) GTEST_SKIP();
  std::istringstream in(paths);
  for (std::string path; in >> path;) {
    std::printf("======== %s\n", path.c_str());
    try {
      const CaptureProblem p = load_scenario(path);
      const auto begin = std::chrono::steady_clock::now();
      double last = 0;
      const CaptureResult r = simulate_capture(p, [&](const std::string& phase, double t, double end) {
        const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        if (s - last > 5) last = s, std::printf("... %s t=%.6g of %.6g after %.1f s\n", phase.c_str(), t, end, s), std::fflush(stdout);
        if (std::getenv("LIMIT") && s > std::atof(std::getenv("LIMIT"))) throw std::runtime_error("time is over");
      }, std::getenv("COLUMNS_ONLY") ? CaptureDetail::columns : CaptureDetail::full);
      std::printf("wall %.2f s\n", std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
      for (const auto& w : r.warnings) std::printf("WARNING %s\n", w.c_str());
      std::printf("FAILURE %s\n%s\n", r.failure.c_str(), result_table(r).c_str());
    } catch (const std::exception& e) {
      std::printf("EXCEPTION %s\n", e.what());
    }
    std::fflush(stdout);
  }
}
}
