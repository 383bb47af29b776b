"""libigl's ambient occlusion per vertex against `umbel bake --vertices`.

Timed is `igl.embree.ambient_occlusion` alone: it builds Embree's tree and traces, with as many threads as libigl takes. Its
rays are random and of any length; 1 means occluded. Vertex normals are computed before. `igl.ambient_occlusion` without
Embree takes much longer.
"""

import comparison


def main():
    parser = comparison.options(__doc__)
    args = parser.parse_args()
    igl = comparison.require("igl", "libigl")
    embree = comparison.require("igl.embree", "libigl").embree
    vertices, faces = igl.read_triangle_mesh(str(args.scene))[:2]
    normals = igl.per_vertex_normals(vertices, faces)

    def work():
        return embree.ambient_occlusion(vertices, faces, vertices, normals, args.rays)

    def facts(occlusion):
        return {
            "vertices": len(vertices),
            "triangles": len(faces),
            "mean_openness": 1.0 - float(occlusion.mean()),
        }

    comparison.compare(args, "libigl", work, ["--vertices"], facts)


if __name__ == "__main__":
    main()
