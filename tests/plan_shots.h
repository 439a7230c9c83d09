#pragma once
// Small shots, one a line of the program's abilities: together they turn every effect on, and off.
#include <string>
#include <vector>

struct SmallShot {
  std::string name, text;
  std::vector<std::string> sets = {};
};

/// Two frames of one body; `sim` are lines of [sim].
inline std::string one_body(const std::string& sim, const std::string& name, const std::string& box, const std::string& picture) {
  return "[shot]\nframes = 2\nfps = 24\ncheckpoint_every = 2\n[sim]\n" + sim + "[[body]]\nname = \"" + name + "\"\nshape = { box = " + box +
         " }\n[render]\n" + picture;
}
inline const std::string kRoom = "domain = [[0, 0, 0], [0.8, 0.4, 0.4]]\ncell = 0.1\n",
                         kSheet = "dimension = 2\ndomain = [[0, 0], [0.8, 0.4]]\ncell = 0.05\n";
inline const std::string kSmallPicture = "width = 32\nheight = 16\nspp = 1\n", kFlatPicture = "width = 64\nheight = 32\n",
                         kSolid = "solver = \"solid\"\n";

inline const std::string kTank = one_body(kRoom, "water", "[[0, 0, 0], [0.4, 0.4, 0.2]]", kSmallPicture);
inline const std::string kFlatTank = one_body(kSheet, "water", "[[0, 0], [0.4, 0.2]]", kFlatPicture);
inline const std::string kBlock = one_body(kSolid + kRoom, "block", "[[0.1, 0.1, 0], [0.4, 0.3, 0.2]]", kSmallPicture);
inline const std::string kPlate = one_body(kSolid + kSheet, "block", "[[0.1, 0.1], [0.4, 0.2]]", kFlatPicture);
inline std::string more_body(const std::string& name, const std::string& box, const std::string& material) {
  return "[[body]]\nname = \"" + name + "\"\nshape = { box = " + box + " }\nmaterial = \"" + material + "\"\n";
}
inline const std::string kGravity = "[[effect]]\nkind = \"gravity\"\n";

inline std::string ball(const std::string& name, const std::string& center, double radius) {
  return "[[collider]]\nname = \"" + name + "\"\nshape = { sphere = { center = " + center + ", radius = " + std::to_string(radius) + " } }\n";
}
inline const std::string kBall = ball("ball", "[0.6, 0.2, 0.1]", 0.12), kDisc = ball("disc", "[0.6, 0.1]", 0.08);

inline std::string source(const std::string& name, const std::string& box, const std::string& velocity) {
  return "[[source]]\nname = \"" + name + "\"\nshape = { box = " + box + " }\nvelocity = " + velocity + "\n";
}
inline const std::string kSpout = source("spout", "[[0.6, 0.1, 0.2], [0.8, 0.3, 0.4]]", "[-1, 0, 0]");

inline std::string look(const std::string& keys) { return "[look.special]\n" + keys; }

inline std::vector<SmallShot> small_shots() {
  const std::vector<std::string> special = {"body.water.look=special"};
  const std::string periodic = "sim.boundary={x_lower=\"periodic\",x_upper=\"periodic\"",
                    everywhere = periodic + ",y_lower=\"periodic\",y_upper=\"periodic\",z_lower=\"periodic\",z_upper=\"periodic\"}";
  std::vector<SmallShot> shots = {
      {"weightless", kTank},
      {"falling", kTank + kGravity},
      {"weightless_gravity", kTank + kGravity, {"effect.1.acceleration=[0,0,0]"}},
      {"ball", kTank + kGravity + kBall},
      {"pic", kTank + kGravity, {"sim.transfer=pic"}},
      {"flip", kTank + kGravity, {"sim.transfer=flip"}},
      {"apic", kTank + kGravity, {"sim.transfer=apic"}},
      {"apic_quadratic", kTank + kGravity, {"sim.transfer=apic", "sim.kernel=quadratic"}},
      {"few_modes", kTank + kGravity, {"sim.modes=5"}},
      {"all_modes", kTank + kGravity, {"sim.kernel=quadratic"}},
      {"limited", kTank + kGravity, {"sim.kernel=quadratic", "sim.carry=limited"}},
      {"hybrid", kTank + kGravity, {"sim.kernel=quadratic", "sim.carry=hybrid", "sim.modes=quadratic"}},
      {"reflection", kTank + kGravity, {"sim.splitting=reflection"}},
      {"third_order", kTank + kGravity, {"sim.advection=rk3"}},
      {"drifting", kTank + kGravity, {"sim.volume_correction=0"}},
      {"audited", kTank + kGravity, {"sim.audit=true"}},
      {"audited_block", kBlock + kGravity, {"sim.audit=true"}},
      {"double", kTank + kGravity, {"sim.precision=double"}},
      {"regular", kTank + kGravity, {"sim.seeding=regular"}},
      {"channel", kTank, {periodic + "}"}},
      {"without_pictures", kTank.substr(0, kTank.find("[render]")), {}},
      {"without_walls", kTank, {everywhere}},
      {"ball_without_walls", kTank + kBall, {everywhere}},
      {"open", kTank + kGravity, {"sim.boundary={x_lower=\"open\"}"}},
      {"stirred", kTank + kGravity + kBall, {"collider.ball.velocity=[0.1,0,0]"}},
      {"poured", kTank + kGravity + kSpout},
      {"poured_alone", "[shot]\nframes = 2\nfps = 24\n[sim]\ndimension = 2\n" + kSheet.substr(kSheet.find("domain")) + source("spout", "[[0, 0.2], [0.1, 0.3]]", "[1, 0]") +
                           "[render]\n" + kFlatPicture},
      {"rough", kTank, {"surface.smooth=0"}},
      {"swirls", kTank + kGravity, {"preview.color=vorticity", "preview.draw=surface"}},
      {"pressed", kTank + kGravity, {"sim.write.pressure=true", "preview.color=pressure"}},
      {"strained", kBlock + kGravity, {"sim.write={pressure=true,strain=true,mode_energy=true}", "preview.color=strain"}},
      {"modes_seen", kBlock + kGravity, {"sim.write.mode_energy=true", "preview.color=mode_energy"}},
      {"kinds", kBlock + kGravity, {"preview.color=material"}},
      {"along_x", kTank, {"preview.color=velocity_x"}},
      {"along_y", kFlatTank, {"preview.color=velocity_y"}},
      {"along_z", kTank, {"preview.color=velocity_z"}},
      {"grains", kTank, {"body.water.look=sand"}},
      {"frozen", kTank, {"camera.shutter=0"}},
      {"lens", kTank, {"camera.aperture=2.8"}},
      {"camera_keys", kTank + "[[camera.key]]\nframe = 1\nposition = [0, -2, 1]\n[[camera.key]]\nframe = 2\nposition = [0.5, -2, 1]\n"},
      {"turntable", kTank + "[camera.turntable]\nframes = 8\n"},
      {"sphere_light", kTank + "[[light]]\nkind = \"sphere\"\n"},
      {"sun", kTank + "[[light]]\nkind = \"sun\"\n[[light]]\nkind = \"sky\"\n"},
      {"environment", kTank + "[[light]]\nkind = \"environment\"\nfile = \"sky.png\"\n"},
      {"set", kTank + "[[set]]\nname = \"piece\"\nmesh = { file = \"piece.obj\" }\n"},
      {"steel", kTank + look("model = \"conductor\"\n"), special},
      {"clay", kTank + look("model = \"coated\"\n"), special},
      {"wax", kTank + look("model = \"translucent\"\n"), special},
      {"lamp", kTank + look("model = \"emissive\"\n"), special},
      {"milk", kTank + look("model = \"dielectric\"\nscattering = [1, 1, 1]\n"), special},
      {"caustics", kTank, {"render.caustics=path"}},
      {"shadows", kTank, {"render.caustics=none"}},
      {"studio", kTank, {"render.ground=cyclorama"}},
      {"nothing_below", kTank, {"render.ground=none"}},
      {"adaptive", kTank, {"render.noise=0.1", "render.spp=16"}},
      {"hurried", kTank, {"render.time_limit=100"}},
      {"denoised", kTank, {"render.denoise=picture", "render.spp=2"}},
      {"denoised_layer", kTank, {"render.denoise=layer", "render.spp=2"}},
      {"plain", kTank, {"render.view=srgb"}},
      {"solid", kBlock},
      {"solid_falling", kBlock + kGravity + kBall, {"collider.ball.contact=sticky", "sim.transfer=apic"}},
      {"solid_metal", kBlock + kGravity, {"body.block.material=clay", "sim.modes=full", "sim.carry=limited"}},
      {"solid_sand", kBlock + kGravity, {"body.block.material=dry_sand", "body.block.transfer=pic"}},
      {"solid_snow", kBlock + kGravity, {"body.block.material=snow", "body.block.transfer=flip"}},
      {"solid_liquid", kBlock + kGravity, {"body.block.material=water_mpm", "sim.boundary={z_lower=\"sticky\",x_lower=\"slip\"}"}},
      {"solid_fixed", kBlock + kGravity, {"body.block.material={volume_averaging=true}", "body.block.carry=fixed", "body.block.modes=8"}},
      {"solid_looks", kBlock + kGravity + more_body("lump", "[[0.5, 0.1, 0], [0.7, 0.3, 0.1]]", "clay") +
                          more_body("heap", "[[0.1, 0.1, 0.25], [0.3, 0.3, 0.35]]", "dry_sand")},
      {"flat_solid", kPlate + kGravity},
      {"flat", kFlatTank},
      {"flat_falling", kFlatTank + kGravity + kDisc},
      {"flat_quadratic", kFlatTank + kGravity, {"sim.kernel=quadratic", "sim.carry=limited"}},
      {"flat_channel", kFlatTank + kDisc, {periodic + "}", "sim.precision=double"}},
  };
  return shots;
}

/// Beside the shots: what they name.
inline const std::string kPiece = "v 0 0 0\nv 0.2 0 0\nv 0 0.2 0.2\nf 1 2 3\n";
