// Joint motion as excitation for an identification (20.7).
#include "grapnel/approach/phase_setups.hpp"

namespace grapnel {
namespace {

// Adds swings about `hold`, each from rest to rest, starting at `begin`.
void add_swings(const ExcitationSetup& excitation, double begin, double duration, double hold, std::size_t joint,
                std::vector<JointPiece>& pieces) {
  const int swings = excitation.swings + static_cast<int>(joint % 3), count = 2 * swings + 1;
  double from = hold;
  for (int k = 0; k < count; ++k) {
    const double amplitude = excitation.amplitude[joint];
    const double to = k + 1 == count ? hold : hold + (k % 2 == 0 ? amplitude : -amplitude);
    const double start = begin + duration * k / count, end = begin + duration * (k + 1) / count;
    pieces.push_back({start, end, JointPath{JointProfile::quintic, end - start, from, to}});
    from = to;
  }
}

}  // namespace

// Settings after the impact => whether held joints move: to a posture, or as excitation.
bool moves_afterwards(const PostImpactSetup& post) { return post.move || (post.identify && post.identify->excitation); }

// Settings after the impact and hold value of a joint => its reference: constant, or swings for an identification
// (20.7) and then the move to a posture, from rest to rest.
JointTrajectory settled_trajectory(const PostImpactSetup& post, const SegmentControl& control, std::size_t joint) {
  const double hold = control.hold[joint];
  if (control.approaching || !moves_afterwards(post)) return JointTrajectory::at_rest(hold);
  JointTrajectory trajectory;
  if (post.identify && post.identify->excitation)
    add_swings(*post.identify->excitation, control.post_impact_begin + post.identify->from, post.identify->duration,
               hold, joint, trajectory.pieces);
  if (!post.move) return trajectory;
  const PostureMove& move = *post.move;
  const double begin = control.post_impact_begin + move.after;
  if (!trajectory.pieces.empty()) {
    const double end = trajectory.pieces.back().end;
    if (begin > end) trajectory.pieces.push_back({end, begin, JointPath{move.profile, begin - end, hold, hold}});
  }
  const double leaves = trajectory.pieces.empty() ? begin : trajectory.pieces.back().end;
  trajectory.pieces.push_back(
      {leaves, leaves + move.duration, JointPath{move.profile, move.duration, hold, move.joints[joint]}});
  return trajectory;
}

}  // namespace grapnel
