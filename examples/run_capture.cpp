// Does what `grapnel run` does with the library: reads a scenario file, writes a summary and a time series, and prints
// the verdict.
#include <iostream>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/scenario/scenario.hpp"

int main(int argc, char** argv) {
  if (argc != 3) return std::cerr << "usage: run_capture SCENARIO.yaml FOLDER\n", 2;
  const std::filesystem::path folder = argv[2];
  try {
    grapnel::CaptureProblem problem = grapnel::load_scenario(argv[1]);
    problem.impact->duration = 2e-3;  // the contents of the file are plain data that a program can change

    const grapnel::CaptureResult result = grapnel::simulate_capture(problem);
    for (const grapnel::GraspImpulse& grasp : result.impact->grasps) {
      std::cout << grasp.end_effector << ": " << grasp.impulse_magnitude << " N s, mean force " << grasp.mean_force
                << " N\n";
    }
    std::cout << "ledger: " << (result.ledger.pass() ? "pass" : "FAIL") << '\n';

    std::filesystem::create_directories(folder);
    grapnel::write_file_atomically(folder / "summary.json", grapnel::summary_json(result, "example"));
    grapnel::write_timeseries_hdf5(result.series, {"example", problem.name, problem.sha256}, folder / "timeseries.h5");
    return result.ledger.pass() ? 0 : 1;
  } catch (const std::exception& error) {
    return std::cerr << error.what() << '\n', 2;
  }
}
