#include "grapnel/result/result_documents.hpp"

#include <array>

namespace grapnel {
namespace {

enum class SceneFormat { first };

struct OfScenario {
  std::string name, sha256;
};

}  // namespace

template <>
const Type& type_of<SceneFormat>() {
  static constexpr Choice choices[] = {choice(SceneFormat::first, "grapnel-scene/1")};
  static constexpr Type type = enumeration<SceneFormat>("SceneFormat", choices);
  return type;
}

template <>
const Type& type_of<OfScenario>() {
  static constexpr Field fields[] = {
      field<&OfScenario::name>("name", "the scenario's name"),
      field<&OfScenario::sha256>("sha256", "as in summary.json"),
  };
  static constexpr Type type = structure<OfScenario>("SceneScenario", "what was simulated.", fields);
  return type;
}

template <>
const Type& type_of<SceneMesh>() {
  static constexpr Field fields[] = {
      field<&SceneMesh::name>("name", "of the file"),
      field<&SceneMesh::vertices>("vertices", "1",
                                  "x, y, z in turn, in the file's unit: the size of a shape makes them metres"),
      field<&SceneMesh::triangles>("triangles", "1", "three vertex numbers in turn, from 0"),
  };
  static constexpr Type type = structure<SceneMesh>("SceneMesh", "a triangle mesh in its own frame.", fields);
  return type;
}

template <>
const Type& type_of<SceneShape>() {
  using S = SceneShape;
  static constexpr Field fields[] = {
      field<&S::shape>("shape", "`box`, `cylinder`, `capsule`, `sphere`, `mesh`"),
      field<&S::size>("size", "m", "by shape, see below; of a mesh what vertices are multiplied with"),
      derived<[](const S& s) { return s.X_BG.p; }>("position", "m", "of the shape's frame in the body's"),
      derived<[](const S& s) { return quaternion_from(s.X_BG.R); }>("quaternion_wxyz", "1",
                                                                    "of the shape's frame in the body's"),
      field<&S::mesh>("mesh", "1", "of shape `mesh`: index into `meshes`")
          .when<[](const S& s) { return s.shape == "mesh"; }>(),
  };
  static constexpr Type type = structure<S>("SceneShape", "a shape on a body.", fields);
  return type;
}

template <>
const Type& type_of<SceneJoint>() {
  using J = SceneJoint;
  static constexpr Field fields[] = {
      field<&J::name>("name", "of the joint"),
      field<&J::type>("type", "`revolute`, `continuous`, `prismatic`, `fixed`"),
      field<&J::axis>("axis", "1", "unit, in the joint's frame"),
      derived<[](const J& j) { return j.X_PF.p; }>("position", "m",
                                                   "of the joint's frame in the parent's at joint value 0"),
      derived<[](const J& j) { return quaternion_from(j.X_PF.R); }>("quaternion_wxyz", "1", "likewise"),
  };
  static constexpr Type type = structure<J>("SceneJoint", "how a link hangs on its parent.", fields);
  return type;
}

template <>
const Type& type_of<SceneBody>() {
  using B = SceneBody;
  static constexpr Field fields[] = {
      field<&B::name>("name", "unique among base and links, and among targets; a target may be called like a link"),
      field<&B::kind>("kind", "`base`, `link`, `target`"),
      derived<[](const B& b) { return b.parent.empty() ? std::nullopt : std::optional(b.parent); }>(
          "parent", "", "of links: base or an earlier link; else null")
          .or_null(),
      field<&B::joint>("joint", "of links; else null").or_null(),
      field<&B::series>("series",
                        "its motion in the time series: SERIES/position and SERIES/quaternion_wxyz are the pose of its "
                        "frame in W. `base`, `links/NAME`, `targets/NAME`"),
      field<&B::mass>("mass", "kg", "of the body"),
      field<&B::com>("com", "m", "centre of mass in its frame"),
      derived<[](const B& b) {
        const Symmetric3d& m = b.inertia;
        return std::array{m.xx, m.yy, m.zz, m.xy, m.xz, m.yz};
      }>("inertia", "kg m^2", "xx, yy, zz, xy, xz, yz about the centre of mass, its axes"),
      field<&B::shape>("geometry", "its shape, or null").or_null(),
  };
  static constexpr Type type = structure<B>("SceneBody", "a rigid body.", fields);
  return type;
}

template <>
const Type& type_of<SceneFrame>() {
  using F = SceneFrame;
  static constexpr Field fields[] = {
      field<&F::name>("name", "of the end-effector"),
      field<&F::body>("body", "of the robot"),
      derived<[](const F& f) { return f.X_BE.p; }>("position", "m", "in that body's frame"),
      derived<[](const F& f) { return quaternion_from(f.X_BE.R); }>("quaternion_wxyz", "1", "in that body's frame"),
  };
  static constexpr Type type = structure<F>("SceneEndEffector", "an end-effector on a body of the robot.", fields);
  return type;
}

template <>
const Type& type_of<SceneGraspPoint>() {
  using P = SceneGraspPoint;
  static constexpr Field fields[] = {
      field<&P::target>("target", "that it is on"),
      field<&P::name>("name", "of the grasp point"),
      field<&P::position>("position", "m", "in the target's frame"),
      field<&P::approach_direction>("approach_direction", "1", "unit, in the target's frame; null: none is given")
          .or_null(),
  };
  static constexpr Type type = structure<P>("SceneGraspPoint", "where a target may be grasped.", fields);
  return type;
}

template <>
const Type& type_of<SceneGrasp>() {
  using G = SceneGrasp;
  static constexpr Field fields[] = {
      field<&G::end_effector>("end_effector", "that grasps"),
      field<&G::target>("target", "that is grasped"),
      field<&G::grasp_point>("grasp_point", "of the target"),
      field<&G::model>("model", "`rigid`, `hinge`, `point`, or `contact` for what is only touched"),
  };
  static constexpr Type type = structure<G>("SceneGrasp", "what is to meet.", fields);
  return type;
}

template <>
const Type& type_of<SceneLimits::Grasp>() {
  using G = SceneLimits::Grasp;
  static constexpr Field fields[] = {
      field<&G::end_effector>("end_effector", "that has an envelope"),
      field<&G::position>("position", "m", "largest distance from the grasp point; null: any").or_null(),
      field<&G::velocity>("velocity", "m/s", "largest relative speed; null: any").or_null(),
  };
  static constexpr Type type = structure<G>("SceneGraspLimits", "what a grasp can close on.", fields);
  return type;
}

template <>
const Type& type_of<SceneLimits>() {
  using L = SceneLimits;
  static constexpr Field fields[] = {
      field<&L::grasps>("grasps", "of end-effectors with an envelope"),
      field<&L::clearance>("clearance", "m", "the distance that bodies are to keep; null: it is not watched").or_null(),
  };
  static constexpr Type type = structure<L>("SceneLimits", "lines in plots.", fields);
  return type;
}

template <>
const Type& type_of<SceneDocument>() {
  using S = SceneDocument;
  static constexpr Field fields[] = {
      derived<[](const S&) { return SceneFormat::first; }>("schema", "", "the format of this file"),
      field<&S::version>("version", "of Grapnel"), derived<[](const S& s) {
        return OfScenario{s.scenario_name, s.scenario_sha256};
      }>("scenario", "", "what was simulated"),
      derived<[](const S& s) {
        return s.scene.planar;
      }>("planar", "",
         "true if nothing ever moves but along the plane z = 0: all joints turn about z or slide along the plane; it "
         "holds the centre of mass of every body (with what is fixed to it) and is a principal plane of it; "
         "end-effectors and grasp points lie in it; initial velocities, momentum, gravity and loads keep to it (all to "
         "1e-9)"),
      derived < [](const S& s) -> auto& {return s.scene.bodies;
}
> ("bodies", "", "base first, then links (parents before children), then targets"), derived < [](const S& s) -> auto& {
  return s.scene.end_effectors;
}
> ("end_effectors", "", "of the robot"), derived < [](const S& s) -> auto& { return s.scene.grasp_points; }
> ("grasp_points", "", "of all targets"), derived < [](const S& s) -> auto& { return s.scene.grasps; }
> ("grasps", "", "of the scenario"), derived < [](const S& s) -> auto& { return s.scene.meshes; }
> ("meshes", "", "that shapes refer to"), derived < [](const S& s) -> auto& { return s.scene.limits; }
> ("limits", "", "results of earlier versions lack it"),
};  // namespace grapnel
static constexpr Type type =
    structure<S>("Scene", "which bodies there are, how they hang together and what they look like.", fields);
return type;
}

}  // namespace grapnel
