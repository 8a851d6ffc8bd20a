#pragma once

/// @file
/// Operation counts of the kernels, obtained with a counting scalar.

#include "bench/workload.hpp"

namespace grapnel::bench {

/// Additions, subtractions, multiplications and divisions count one each; a fused product and sum counts two. Sines and
/// cosines are counted separately: a pair counts one.
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
