// Does what `grapnel run` does with the library: reads a scenario file, changes a value, simulates the capture, prints
// the verdict, and writes the result folder.
#include <iostream>

#include "grapnel/api/capture.hpp"
#include "grapnel/api/report.hpp"
#include "grapnel/api/scenario.hpp"

int main(int argc, char** argv) {
  if (argc != 3) return std::cerr << "usage: capture SCENARIO.yaml FOLDER\n", 2;
  try {
    std::vector<grapnel::Fault> warnings;
    grapnel::CaptureProblem problem = grapnel::load_scenario(argv[1], {}, &warnings);
    for (const grapnel::Fault& warning : warnings) std::cerr << warning.text() << '\n';
    problem.impact->duration = 2e-3;  // the contents of the file are plain data that a program can change

    std::stop_source stop;  // stop.request_stop() in another thread ends the run
    std::string phase;
    const auto progress = [&](const std::string& now, double, double) {
      if (now != phase) std::cout << (phase = now) << "...\n";
    };
    const grapnel::CaptureResult result =
        grapnel::simulate_capture(problem, grapnel::until_stopped(stop.get_token(), progress));
    if (result.status != grapnel::CaptureStatus::completed) return std::cerr << result.failure << '\n', 1;

    for (const grapnel::GraspImpulse& grasp : result.impact()->grasps) {
      std::cout << grasp.end_effector << ": " << grasp.impulse_magnitude << " N s, mean force " << grasp.mean_force
                << " N\n";
    }
    std::cout << "captured: " << (result.captured() ? "yes" : "no")
              << ", ledger: " << (result.ledger.pass() ? "pass" : "FAIL") << '\n';
    save_results(problem, result, argv[2]);
    if (grapnel::has_reports()) grapnel::save_report(argv[2]);
    return result.ledger.pass() ? 0 : 1;
  } catch (const grapnel::InputError& error) {
    for (const grapnel::Fault& fault : error.faults()) std::cerr << fault.text() << '\n';
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
  }
  return 2;
}
