//! Reads OBJ text that is not plain, through `tobj`: with its warnings and with what is wrong.

use tobj::{LoadError, LoadOptions, Mesh};

use crate::error::Problem;
use crate::files::budget::Budget;
use crate::formats::obj::mesh::ObjMesh;
use crate::formats::obj::source::{Source, measure};
use crate::formats::polygons::faces::Faces;
use crate::scene::NO_INDEX;

/// The mesh of any text.
pub(crate) fn read_odd(text: &[u8], budget: &Budget) -> Result<ObjMesh, Problem> {
    let extent = measure(text)?;
    let what = format!("{} faces and {} vertices", extent.faces, extent.counts[0]);
    budget.check(extent.bytes(), &what)?;
    let mut source = Source::new(text, extent.counts);
    let mesh = parse(&mut source)?;
    let (mut uvs, mut normals) = (mesh.texcoords.as_chunks().0.to_vec(), mesh.normals.as_chunks().0.to_vec());
    // What stands for none.
    uvs.pop();
    normals.pop();
    Ok(ObjMesh {
        positions: mesh.positions.as_chunks().0.to_vec(),
        faces: vec![faces(&mesh, &source, [usize::MAX, uvs.len(), normals.len()])],
        uvs,
        normals,
        parts: source.parts.0,
        libraries: source.libraries,
        creases: source.creases,
        left_out: source.left_out,
        dangling: source.dangling,
    })
}

/// Has tobj parse the source, as one mesh.
fn parse(source: &mut Source<'_>) -> Result<Mesh, Problem> {
    let options = LoadOptions { triangulate: false, single_index: false, ..LoadOptions::default() };
    // tobj never sees `mtllib`, so it asks for no library.
    match tobj::load_obj_buf(source, &options, |_| Err(LoadError::GenericFailure)) {
        Ok((models, _)) => Ok(models.into_iter().next().map(|model| model.mesh).unwrap_or_default()),
        Err(error) => Err(source.problem.take().unwrap_or_else(|| {
            source.error(match error {
                LoadError::PositionParseError => "a `v` needs three numbers".to_owned(),
                LoadError::TexcoordParseError => "a `vt` needs one or two numbers".to_owned(),
                LoadError::NormalParseError => "a `vn` needs three numbers".to_owned(),
                other => other.to_string(),
            })
        })),
    }
}

/// The faces behind the preamble. What names an entry past the file's own names none.
fn faces(mesh: &Mesh, source: &Source<'_>, counts: [usize; 3]) -> Faces {
    // tobj leaves the arities out where all are 3.
    let arities = mesh.face_arities.get(source.preamble_faces..).unwrap_or_default();
    let preamble: usize = match mesh.face_arities.get(..source.preamble_faces) {
        Some(arities) => arities.iter().map(|&arity| arity as usize).sum(),
        None => 3 * source.preamble_faces,
    };
    let own = |(indices, count): (&Vec<u32>, usize)| -> Vec<u32> {
        let own = indices.get(preamble..).unwrap_or_default();
        own.iter().map(|&index| if (index as usize) < count { index } else { NO_INDEX }).collect()
    };
    let [positions, uvs, normals] = counts;
    Faces {
        count: source.faces,
        arities: if arities.iter().all(|&arity| arity == 3) { Vec::new() } else { arities.to_vec() },
        corners: [(&mesh.indices, positions), (&mesh.texcoord_indices, uvs), (&mesh.normal_indices, normals)]
            .map(own),
    }
}
