// Runs a scenario with the installed library only.
#include <iostream>

#include "grapnel/api/grapnel.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return std::cerr << "usage: outside SCENARIO.yaml\n", 2;
  try {
    const grapnel::CaptureProblem problem = grapnel::load_scenario(argv[1]);
    const grapnel::CaptureResult result = grapnel::simulate_capture(problem);
    std::cout << problem.name << ", ledger: " << (result.ledger.pass() ? "pass" : "FAIL") << '\n';
    return result.ledger.pass() ? 0 : 1;
  } catch (const std::exception& error) {
    return std::cerr << error.what() << '\n', 2;
  }
}
