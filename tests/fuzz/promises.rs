//! What a scene promises, whichever file it was read from.

use umbel::Scene;
use umbel::scene::{NO_INDEX, info};

/// What the fields of a scene promise.
pub(crate) fn check(scene: &Scene) {
    scene.geometry().expect("finite positions, indices in range");
    let finite = |values: &[f32]| values.iter().all(|x| x.is_finite());
    assert!(scene.normals.iter().all(|n| finite(n)) && scene.uvs.iter().all(|uv| finite(uv)));
    for (indices, count) in
        [(&scene.normal_indices, scene.normals.len()), (&scene.uv_indices, scene.uvs.len())]
    {
        assert!(indices.is_empty() || indices.len() == scene.triangles.len());
        assert!(indices.iter().flatten().all(|&i| i == NO_INDEX || (i as usize) < count));
    }
    let mut end = 0;
    for object in &scene.objects {
        assert!(object.triangles.start == end && object.triangles.end > end, "{:?}", scene.objects);
        end = object.triangles.end;
        assert!(object.material.is_none_or(|m| (m as usize) < scene.materials.len()));
    }
    assert_eq!(end as usize, scene.triangles.len());
    assert!(scene.materials.iter().all(|m| m.diffuse.iter().all(|x| (0.0..=1.0).contains(x))));
    let _ = info(scene);
}
