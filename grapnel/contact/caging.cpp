#include "grapnel/contact/caging.hpp"

#include "grapnel/contact/cage_poses.hpp"

namespace grapnel {
namespace {

// Whether a ball inside of the body cannot leave, so that the body cannot either: a search of positions only.
void prove_inner_ball_caged(const Cage& cage, const CagePoses& poses, long max_cells, CageAnswer& answer) {
  const Ball ball = poses.inner_ball();
  Geometry sphere;
  sphere.shape = Geometry::Shape::sphere, sphere.size = {ball.radius, 0, 0}, sphere.X_BG.p = ball.center;
  const Cage inner{cage.fixed, {ContactShape(sphere)}, cage.X_FM};
  CagePoses of_ball(inner, poses.resolution(), poses.allowance());
  CageAnswer found;
  prove_caged(of_ball, max_cells, found);
  answer.cells += found.cells;
  if (found.verdict == CageAnswer::Verdict::caged) answer.verdict = found.verdict;
}

}  // namespace

// Cage => answer: first a search for a path that leads out, which is quick if there is a wide one; then proofs that
// there is none: by an inner ball, whose rotations need no search, and by the whole body.
CageAnswer search_cage(const Cage& cage, const CageSearch& search) {
  using Verdict = CageAnswer::Verdict;
  CagePoses poses(cage, search.resolution);
  CageAnswer answer;
  answer.resolution = poses.resolution(), answer.allowance = poses.allowance();
  if (find_escape(poses, search.max_cells / 10, answer.cells)) {
    answer.verdict = Verdict::can_leave;
    return answer;
  }
  if (poses.rotations().dims > 0) prove_inner_ball_caged(cage, poses, search.max_cells / 4, answer);
  if (answer.verdict == Verdict::undecided) prove_caged(poses, search.max_cells, answer);
  return answer;
}

}  // namespace grapnel
