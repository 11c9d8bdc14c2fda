#include <gtest/gtest.h>

#include "transport/clear_panes.h"
#include "transport/court.h"

// In which scenes light samples may look through panes: where all kinds of rays see the same.

namespace cistern::test {
namespace {

struct Change {
  const char* name;
  void (*make)(Court&);
  bool may_pass = false;
};

/// The lamp added last, changed.
template <class Edit>
void add_lamp(Court& court, Edit edit) {
  Light lamp = court.area_lamp({0, 0, 3}, 1.0f, -1.0f, 1.0f);
  edit(lamp);
  court.builder.add_light(lamp);
}

template <class Edit>
void add_board(Court& court, Edit edit, int material = -1) {
  Instance board = court.floor(2.0f, 1.0f, material < 0 ? court.diffuse(0.5f) : material);
  edit(board);
  court.replace_last(board);
}

int reads_path(Court& court, Op closure, int output) {
  ProgramBuilder p;
  const Operand is_so = p.add(Op::LIGHT_PATH, {}, {output});
  if (closure == Op::CLOSURE_EMISSION) p.add(closure, {is_so, p.constant(1), p.constant(1)});
  if (closure == Op::CLOSURE_TRANSPARENT) p.add(closure, {is_so, p.constant(1)});
  return court.builder.add_material(p.program);
}

constexpr int kIsCamera = 0, kIsDiffuse = 2;

const Change kChanges[] = {
    {"nothing", [](Court&) {}, true},
    {"a lamp with a limit", [](Court& c) { add_lamp(c, [](Light& l) { l.max_bounces = 3; }); }},
    {"a lamp without shadow", [](Court& c) { add_lamp(c, [](Light& l) { l.casts_shadow = false; }); }},
    {"one that scattered rays do not find",
     [](Court& c) { add_lamp(c, [](Light& l) { l.casts_shadow = l.use_mis = false; }); }, true},
    {"one without size",
     [](Court& c) { add_lamp(c, [](Light& l) {
                      l.casts_shadow = false, l.shape = PointLight{{0, 0, 2}, 0.0f};
                    }); },
     true},
    {"a lamp that gloss does not see",
     [](Court& c) { add_lamp(c, [](Light& l) { l.visibility = kVisibleToAll & ~kVisibleToGlossy; }); }},
    {"a lamp for the camera", [](Court& c) { add_lamp(c, [](Light& l) { l.visibility = kVisibleToCamera; }); }, true},
    {"a lamp that is told who asks",
     [](Court& c) { add_lamp(c, [&](Light& l) { l.material = reads_path(c, Op::CLOSURE_EMISSION, kIsDiffuse); }); }},
    {"linked receivers", [](Court& c) { add_lamp(c, [](Light& l) { l.links.lit = 1; }); }},
    {"linked blockers", [](Court& c) { add_board(c, [](Instance& i) { i.links.blockers = 1; }); }},
    {"a board for all but gloss",
     [](Court& c) { add_board(c, [](Instance& i) { i.visibility = kVisibleToAll & ~kVisibleToGlossy; }); }},
    {"a board without shadow",
     [](Court& c) { add_board(c, [](Instance& i) { i.visibility = kVisibleToAll & ~kVisibleToShadow; }); }},
    {"a shadow alone", [](Court& c) { add_board(c, [](Instance& i) { i.visibility = kVisibleToShadow; }); }},
    {"a board for the camera", [](Court& c) { add_board(c, [](Instance& i) { i.visibility = kVisibleToCamera; }); },
     true},
    {"a board for all but what media scatter",
     [](Court& c) { add_board(c, [](Instance& i) { i.visibility = kVisibleToAll & ~kVisibleToVolume; }); }, true},
    {"a catcher of shadows", [](Court& c) { add_board(c, [](Instance& i) { i.is_shadow_catcher = true; }); }},
    {"a curtain that is told who asks",
     [](Court& c) {
       add_board(
           c, [](Instance&) {}, reads_path(c, Op::CLOSURE_TRANSPARENT, kIsDiffuse));
     }},
    {"a panel that is told who asks",
     [](Court& c) {
       add_board(
           c, [](Instance&) {}, reads_path(c, Op::CLOSURE_EMISSION, kIsDiffuse));
     }},
    {"a sky that is told who asks",
     [](Court& c) {
       Environment sky;
       sky.material = reads_path(c, Op::CLOSURE_EMISSION, kIsDiffuse);
       c.builder.set_environment(sky);
     }},
    {"a sky that knows the camera",
     [](Court& c) {
       Environment sky;
       sky.material = reads_path(c, Op::CLOSURE_EMISSION, kIsCamera);
       c.builder.set_environment(sky);
     },
     true},
    {"a sky for the camera",
     [](Court& c) {
       Environment sky;
       sky.material = c.emission({1, 1, 1});
       sky.visibility = kVisibleToCamera;
       c.builder.set_environment(sky);
     },
     true},
};

TEST(ClearPanes, ArePassedWhereAllKindsOfRaysSeeTheSame) {
  for (const Change& change : kChanges) {
    Court court;
    court.pane(), court.sun(0.6f), court.glowing_environment(0.1f, 1.0f);
    change.make(court);
    EXPECT_EQ(may_pass_panes(*court.builder.snapshot(), {}), change.may_pass) << change.name;
  }
  PathScene plain;
  plain.floor(0.0f, 1.0f, plain.diffuse(kAlbedo));
  EXPECT_FALSE(may_pass_panes(*plain.builder.snapshot(), {})) << "no pane";
  Court court;
  court.pane();
  PathLimits softened, without_caustics;
  softened.filter_glossy = 1.0f;
  without_caustics.caustics_refractive = false;
  for (const PathLimits& limits : {softened, without_caustics})
    EXPECT_FALSE(may_pass_panes(*court.builder.snapshot(), limits));
}

}  // namespace
}  // namespace cistern::test
