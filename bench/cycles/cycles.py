"""Run by Blender: blender -b --factory-startup -noaudio -P cycles.py -- export SURFACE.vdb DIR, or ... -- render SCENE.json SPP SEED OUT.exr

export makes water.ply of the level set's zero set and floor.ply, which both renderers read; render draws them with Cycles and prints the
processor seconds that it took."""
import json
import math
import os
import sys
import time

import bpy


def write_ply(path, vertices, faces):
    with open(path, "w") as out:
        out.write("ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n" % len(vertices))
        out.write("element face %d\nproperty list uchar uint vertex_indices\nend_header\n" % len(faces))
        out.writelines("%.7g %.7g %.7g\n" % tuple(v) for v in vertices)
        out.writelines("%d %s\n" % (len(f), " ".join(map(str, f))) for f in faces)


def export(surface, folder):
    bpy.ops.object.volume_import(filepath=surface, directory=os.path.dirname(surface), files=[{"name": os.path.basename(surface)}], use_sequence_detection=False)
    volume = bpy.context.object
    bpy.ops.mesh.primitive_cube_add()
    shell = bpy.context.object
    modifier = shell.modifiers.new("mesh", "VOLUME_TO_MESH")
    modifier.object = volume
    modifier.grid_name = "surface"
    modifier.threshold = 0
    modifier.resolution_mode = "GRID"
    mesh = shell.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    if len(mesh.polygons) < 1000:
        sys.exit("the level set gives %d polygons" % len(mesh.polygons))
    mesh.calc_loop_triangles()
    write_ply(os.path.join(folder, "water.ply"), [v.co for v in mesh.vertices], [tuple(t.vertices) for t in mesh.loop_triangles])
    write_ply(os.path.join(folder, "floor.ply"), [(-30, -30, -0.02), (30, -30, -0.02), (30, 30, -0.02), (-30, 30, -0.02)], [(0, 1, 2), (0, 2, 3)])
    print("water.ply: %d triangles" % len(mesh.loop_triangles))


def read_ply(path, name):
    with open(path) as file:
        vertices = faces = 0
        for line in file:
            words = line.split()
            if words[:2] == ["element", "vertex"]:
                vertices = int(words[2])
            if words[:2] == ["element", "face"]:
                faces = int(words[2])
            if words[0] == "end_header":
                break
        places = [tuple(map(float, next(file).split())) for _ in range(vertices)]
        corners = [tuple(map(int, next(file).split()))[1:] for _ in range(faces)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(places, [], corners)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(thing)
    return thing


def material(thing, kind, **values):
    made = bpy.data.materials.new(kind)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    shader, out = nodes.new(kind), nodes.new("ShaderNodeOutputMaterial")
    for key, value in values.items():
        shader.inputs[key].default_value = value
    links.new(shader.outputs[0], out.inputs["Surface"])
    thing.data.materials.append(made)
    return made


def absorb(made, per_metre):
    """Beer's law: an absorption volume takes density (1 - color)."""
    density = max(per_metre)
    nodes, links = made.node_tree.nodes, made.node_tree.links
    volume = nodes.new("ShaderNodeVolumeAbsorption")
    volume.inputs["Density"].default_value = density
    volume.inputs["Color"].default_value = [1 - a / density for a in per_metre] + [1]
    links.new(volume.outputs[0], nodes["Material Output"].inputs["Volume"])


def place_camera(c):
    from mathutils import Vector
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "VERTICAL"
    data.angle = math.radians(c["fov"])
    camera = bpy.data.objects.new("camera", data)
    camera.location = c["position"]
    camera.rotation_euler = (Vector(c["target"]) - Vector(c["position"])).to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera


def place_light(light):
    """A rectangle that shines with a given radiance, without Blender's conventions for lamps."""
    from mathutils import Vector
    w, h = 0.5 * light["width"], 0.5 * light["height"]
    mesh = bpy.data.meshes.new("light")
    mesh.from_pydata([(-w, -h, 0), (-w, h, 0), (w, h, 0), (w, -h, 0)], [], [(0, 1, 2, 3)])
    thing = bpy.data.objects.new("light", mesh)
    thing.location = light["position"]
    thing.rotation_euler = (Vector(light["target"]) - Vector(light["position"])).to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(thing)
    material(thing, "ShaderNodeEmission", Color=list(light["color"]) + [1], Strength=light["intensity"])


def render(scene_file, spp, seed, out):
    with open(scene_file) as file:
        told = json.load(file)
    folder = os.path.dirname(scene_file)
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    absorb(material(read_ply(os.path.join(folder, "water.ply"), "water"), "ShaderNodeBsdfGlass", Roughness=0, IOR=told["ior"], Color=(1, 1, 1, 1)), told["absorption"])
    material(read_ply(os.path.join(folder, "floor.ply"), "floor"), "ShaderNodeBsdfDiffuse", Color=list(told["floor"]) + [1])
    place_camera(told["camera"])
    place_light(told["light"])
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = list(told["sky"]) + [1]
    scene = bpy.context.scene
    scene.world = world
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = told["width"], told["height"], 100
    scene.render.threads_mode, scene.render.threads = "FIXED", told["threads"]
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = out
    scene.view_settings.view_transform = "Raw"
    c = scene.cycles
    c.device, c.samples, c.seed = "CPU", spp, seed
    c.use_adaptive_sampling = c.use_denoising = False
    c.sample_clamp_direct = c.sample_clamp_indirect = 0
    c.blur_glossy = 0
    c.caustics_reflective = c.caustics_refractive = True
    c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = told["bounces"]
    c.volume_bounces, c.transparent_max_bounces = 0, 8
    c.pixel_filter_type, c.filter_width = "BLACKMAN_HARRIS", 3.0
    start = time.process_time()
    bpy.ops.render.render(write_still=True)
    print("processor seconds %.3f" % (time.process_time() - start))


words = sys.argv[sys.argv.index("--") + 1:]
if words[0] == "export":
    export(os.path.abspath(words[1]), words[2])
else:
    render(os.path.abspath(words[1]), int(words[2]), int(words[3]), os.path.abspath(words[4]))
