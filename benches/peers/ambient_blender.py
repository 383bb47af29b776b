"""Blender's ambient occlusion bake with Cycles against `umbel bake --texels`.

Timed is `bpy.ops.object.bake(type="AO")` alone, on the CPU, with as many samples as there are rays, into an image that is
as large as the one umbel bakes. The mesh needs texture coordinates without overlaps: gallery, gazebo or spot. The margin is 16
texels, Blender's default. Wheels of bpy exist for one version of Python each: 5.0.1 is the newest for Python 3.11.
"""

import comparison


def prepare(bpy, args):
    """The mesh alone in a scene that bakes with Cycles, with an image to bake into."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=str(args.scene), forward_axis="Y", up_axis="Z")
    meshes = [thing for thing in bpy.context.scene.objects if thing.type == "MESH"]
    bpy.ops.object.select_all(action="DESELECT")
    for mesh in meshes:
        mesh.select_set(True)
    bpy.context.view_layer.objects.active = meshes[0]
    if len(meshes) > 1:
        bpy.ops.object.join()
    mesh = bpy.context.view_layer.objects.active
    image = bpy.data.images.new("openness", args.texels, args.texels, float_buffer=True)
    material = bpy.data.materials.new("baked")
    if material.node_tree is None:
        material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node
    mesh.data.materials.clear()
    mesh.data.materials.append(material)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = args.rays
    scene.cycles.use_denoising = False
    scene.world = scene.world or bpy.data.worlds.new("world")
    scene.world.light_settings.distance = 1e9
    if args.threads is not None:
        scene.render.threads_mode, scene.render.threads = "FIXED", args.threads
    return mesh, image


def main():
    parser = comparison.options(__doc__)
    parser.add_argument("--texels", type=int, default=1024, help="along the side of the image (default 1024)")
    args = parser.parse_args()
    bpy = comparison.require("bpy", "bpy")
    # The import tells on stdout how long it took.
    with comparison.elsewhere():
        mesh, image = prepare(bpy, args)

    def work():
        bpy.ops.object.bake(type="AO", margin=16, use_clear=True)
        return image

    def facts(image):
        return {
            "vertices": len(mesh.data.vertices),
            "faces": len(mesh.data.polygons),
            "texels": args.texels,
            "mean_of_image": sum(image.pixels[:][0::4]) / args.texels**2,
        }

    comparison.compare(args, "bpy", work, ["--texels", args.texels], facts)


if __name__ == "__main__":
    main()
