#include <cstdio>

#include "grapnel/api/grapnel.hpp"

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const grapnel::CaptureResult result = grapnel::simulate_capture(grapnel::load_scenario(argv[1]));
  std::printf("%s\n", result.scenario_name.c_str());
}
