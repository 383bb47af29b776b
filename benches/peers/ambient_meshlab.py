"""MeshLab's ambient occlusion per vertex against `umbel bake --vertices`.

Timed is the filter `compute_scalar_ambient_occlusion` alone, on the CPU: the mesh is rendered to depth maps from as many
directions as there are rays, over the whole sphere, so that only about half of them lie above a vertex.
"""

import comparison


def main():
    parser = comparison.options(__doc__)
    args = parser.parse_args()
    meshlab = comparison.require("pymeshlab", "pymeshlab")
    meshes = meshlab.MeshSet()
    meshes.load_new_mesh(str(args.scene))
    mesh = meshes.current_mesh()

    def work():
        meshes.compute_scalar_ambient_occlusion(reqviews=args.rays, usegpu=False)
        return mesh.vertex_scalar_array()

    def facts(openness):
        return {
            "vertices": mesh.vertex_number(),
            "triangles": mesh.face_number(),
            "mean_openness": float(openness.mean()),
        }

    comparison.compare(args, "pymeshlab", work, ["--vertices"], facts)


if __name__ == "__main__":
    main()
