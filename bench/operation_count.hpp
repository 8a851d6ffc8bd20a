#pragma once

/// @file
/// What the kernels cost on paper: they run on a scalar that counts.

#include "bench/workload.hpp"

namespace grapnel::bench {

/// Additions, subtractions and multiplications count one each, and so does a division; a product and a sum that the
/// compiler fuses count two. Sines and cosines are apart: a pair counts one.
struct OperationCount {
  int additions = 0;
  int multiplications = 0;
  int divisions = 0;
  int sine_cosines = 0;
  int flops() const { return additions + multiplications + divisions; }
};

OperationCount count_forward_dynamics(const Workload& workload);
OperationCount count_inverse_dynamics(const Workload& workload);
OperationCount count_mass_matrix(const Workload& workload);

}  // namespace grapnel::bench
