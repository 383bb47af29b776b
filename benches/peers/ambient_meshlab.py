"""MeshLab's ambient occlusion against `umbel bake --vertices`.

Timed is the filter `compute_scalar_ambient_occlusion` of pymeshlab alone, which builds Embree's tree and traces. Its rays start
at the barycentre of each face, and the directions cover the whole sphere, so that only half of them are traced. A closed
mesh has two faces for each vertex: then as many rays are traced as by umbel. The report has both numbers; openness is MeshLab's own, a sum.
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
        meshes.compute_scalar_ambient_occlusion(rays=args.rays)
        return mesh.face_scalar_array()

    def facts(values):
        return {
            "vertices": mesh.vertex_number(),
            "triangles": mesh.face_number(),
            "mean_sum_of_faces": float(values.mean()),
        }

    comparison.compare(args, "pymeshlab", work, ["--vertices"], facts)


if __name__ == "__main__":
    main()
