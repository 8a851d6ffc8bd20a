/// Searches cages with known answers, one line of CSV each: the answer, its allowance, the evaluated poses and the CPU
/// time.
///
///   build/release/bin/cage_survey [PART OF A NAME [POSES]]

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include "tests/contact/cage_cases.hpp"

namespace grapnel {
namespace {

const char* name_of(CageAnswer::Verdict verdict) {
  switch (verdict) {
    case CageAnswer::Verdict::caged:
      return "caged";
    case CageAnswer::Verdict::can_leave:
      return "can_leave";
    case CageAnswer::Verdict::undecided:
      break;
  }
  return "undecided";
}

}  // namespace
}  // namespace grapnel

int main(int argc, char** argv) {
  using namespace grapnel;
  const long poses = argc > 2 ? std::atol(argv[2]) : CageSearch{}.max_cells;
  std::printf("cage,known,answer,allowance_mm,poses,seconds\n");
  for (const testing::CageCase& c : testing::cage_cases_with_answers()) {
    if (argc > 1 && c.name.find(argv[1]) == std::string::npos) continue;
    const std::clock_t begin = std::clock();
    const CageAnswer answer = search_cage(c.cage, {.resolution = c.resolution, .max_cells = poses});
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    std::printf("%s,%s,%s,%.1f,%ld,%.2f\n", c.name.c_str(), name_of(c.verdict), name_of(answer.verdict),
                1e3 * answer.allowance, answer.cells, seconds);
    std::fflush(stdout);
  }
}
