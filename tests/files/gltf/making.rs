//! glTF files made by hand, and what is in written ones.

use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use tempfile::TempDir;
use umbel::formats::{GltfFile, GltfOptions};
use umbel::{Error, Scene};

pub(crate) const BYTE: u32 = 5120;
pub(crate) const UNSIGNED_BYTE: u32 = 5121;
pub(crate) const SHORT: u32 = 5122;
pub(crate) const UNSIGNED_SHORT: u32 = 5123;
pub(crate) const UNSIGNED_INT: u32 = 5125;
pub(crate) const FLOAT: u32 = 5126;

/// A square of two triangles in the plane z = 0.
pub(crate) const SQUARE: [[f32; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
pub(crate) const SQUARE_INDICES: [u16; 6] = [0, 1, 2, 0, 2, 3];
pub(crate) const SQUARE_UVS: [[f32; 2]; 4] = [[0., 1.], [1., 1.], [1., 0.], [0., 0.]];

/// A white image of 2 x 2 pixels.
pub(crate) fn png() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("white.png");
    umbel::files::write_png_rgb8(&path, 2, 2, &[255; 12]).unwrap();
    fs::read(path).unwrap()
}

/// A file in the making: the document and its one buffer.
#[derive(Debug, Clone)]
pub(crate) struct Making {
    pub(crate) json: Value,
    pub(crate) bin: Vec<u8>,
}

impl Making {
    pub(crate) fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0", "generator": "by hand" },
            "scene": 0,
            "scenes": [{ "nodes": [] }],
            "nodes": [], "meshes": [], "accessors": [], "bufferViews": [], "buffers": [{ "byteLength": 0 }],
        });
        Self { json, bin: Vec::new() }
    }

    /// A file with one node, whose mesh is one primitive: its attributes, indices, mode.
    pub(crate) fn with_primitive(make: impl FnOnce(&mut Self) -> Value) -> Self {
        let mut making = Self::new();
        let primitive = make(&mut making);
        let mesh = making.push("meshes", json!({ "primitives": [primitive] }));
        making.node(json!({ "mesh": mesh }));
        making
    }

    /// The square, indexed, with texture coordinates.
    pub(crate) fn square() -> Self {
        Self::with_primitive(Self::square_primitive)
    }

    pub(crate) fn square_primitive(&mut self) -> Value {
        let positions = self.floats(&SQUARE);
        let uvs = self.floats(&SQUARE_UVS);
        let indices = self.indices(&SQUARE_INDICES);
        json!({ "attributes": { "POSITION": positions, "TEXCOORD_0": uvs }, "indices": indices })
    }

    /// Adds an element to an array of the document.
    pub(crate) fn push(&mut self, key: &str, element: Value) -> usize {
        let elements = self.json.as_object_mut().unwrap().entry(key).or_insert_with(|| json!([]));
        let elements = elements.as_array_mut().unwrap();
        elements.push(element);
        elements.len() - 1
    }

    /// Adds a node at the root of the scene.
    pub(crate) fn node(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(index.into());
        index
    }

    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.json["buffers"][0]["byteLength"] = self.bin.len().into();
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }))
    }

    pub(crate) fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes);
        let accessor =
            json!({ "bufferView": view, "componentType": component, "type": kind, "count": count });
        self.push("accessors", accessor)
    }

    /// An accessor of f32 vectors, with the bounds that positions must have.
    pub(crate) fn floats<const N: usize>(&mut self, vectors: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = vectors.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let index = self.accessor(&bytes, FLOAT, ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1], vectors.len());
        if N == 3 {
            let fold = |k: usize, pick: fn(f32, f32) -> f32| vectors.iter().map(|v| v[k]).reduce(pick);
            self.json["accessors"][index]["min"] = (0..3).map(|k| json!(fold(k, f32::min))).collect();
            self.json["accessors"][index]["max"] = (0..3).map(|k| json!(fold(k, f32::max))).collect();
        }
        index
    }

    pub(crate) fn indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        self.accessor(&bytes, UNSIGNED_SHORT, "SCALAR", indices.len())
    }

    pub(crate) fn glb(&self) -> Vec<u8> {
        let mut json = serde_json::to_vec(&self.json).unwrap();
        json.resize(json.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + json.len() + 8 + self.bin.len();
        let word = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
        let header = [*b"glTF", word(2), word(length), word(json.len()), *b"JSON"].concat();
        [header, json, word(self.bin.len()).to_vec(), b"BIN\0".to_vec(), self.bin.clone()].concat()
    }

    /// JSON text whose buffer is a data URI.
    pub(crate) fn gltf(&self) -> Vec<u8> {
        let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&self.bin));
        self.gltf_at(&uri)
    }

    /// JSON text whose buffer is elsewhere.
    pub(crate) fn gltf_at(&self, uri: &str) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"][0]["uri"] = uri.into();
        serde_json::to_vec_pretty(&json).unwrap()
    }

    pub(crate) fn try_read(&self, options: &GltfOptions) -> Result<Scene, Error> {
        let folder = Folder::new(&[("scene.glb", &self.glb())]);
        umbel::formats::read_gltf(&folder.path("scene.glb"), options)
    }

    pub(crate) fn read(&self) -> Scene {
        self.try_read(&GltfOptions::default()).unwrap()
    }

    /// The problem of a refused file, whose remedy is checked to be a sentence.
    pub(crate) fn refusal(&self) -> String {
        refusal(self.try_read(&GltfOptions::default()))
    }
}

pub(crate) fn refusal<T: std::fmt::Debug>(read: Result<T, Error>) -> String {
    match read {
        Err(Error::Input { problem, remedy, path, .. }) => {
            assert!(path.file_stem().unwrap() == "scene", "{}", path.display());
            assert!(remedy.len() > 10 && remedy.ends_with('.'), "{remedy}");
            format!("{problem}\n{remedy}")
        }
        other => panic!("not refused: {other:?}"),
    }
}

/// A folder of its own with some files.
pub(crate) struct Folder(TempDir);

impl Folder {
    pub(crate) fn new(files: &[(&str, &[u8])]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        files.iter().for_each(|(name, bytes)| fs::write(folder.path(name), bytes).unwrap());
        folder
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn open(&self, name: &str) -> (GltfFile, Scene) {
        GltfFile::read(&self.path(name), &GltfOptions::default()).unwrap()
    }
}

/// A GLB that was written, taken apart.
pub(crate) struct Written {
    pub(crate) json: Value,
    pub(crate) bin: Vec<u8>,
}

impl Written {
    pub(crate) fn glb(path: &Path) -> Self {
        let bytes = fs::read(path).unwrap();
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], word(4), word(8)), (b"glTF".as_slice(), 2, bytes.len()));
        let bin = 20 + word(12);
        assert_eq!((bin % 4, &bytes[bin + 4..bin + 8]), (0, b"BIN\0".as_slice()));
        Self {
            json: serde_json::from_slice(&bytes[20..bin]).unwrap(),
            bin: bytes[bin + 8..bin + 8 + word(bin)].to_vec(),
        }
    }

    pub(crate) fn gltf(path: &Path) -> Self {
        Self { json: serde_json::from_slice(&fs::read(path).unwrap()).unwrap(), bin: Vec::new() }
    }

    /// The bytes of a buffer view.
    pub(crate) fn view(&self, index: usize) -> Vec<u8> {
        let view = &self.json["bufferViews"][index];
        let number = |key: &str| usize::try_from(view[key].as_u64().unwrap()).unwrap();
        assert_eq!(number("byteOffset") % 4, 0);
        let range = number("byteOffset")..number("byteOffset") + number("byteLength");
        let buffer = &self.json["buffers"][number("buffer")];
        match buffer["uri"].as_str() {
            Some(uri) => STANDARD.decode(uri.split_once(',').unwrap().1).unwrap()[range].to_vec(),
            None => self.bin[range].to_vec(),
        }
    }

    /// The numbers of an accessor of floats that a primitive names.
    pub(crate) fn floats(&self, mesh: usize, primitive: usize, attribute: &str) -> Vec<f32> {
        let accessor = &self.json["meshes"][mesh]["primitives"][primitive]["attributes"][attribute];
        let accessor = &self.json["accessors"][usize::try_from(accessor.as_u64().unwrap()).unwrap()];
        assert_eq!(accessor["componentType"], FLOAT);
        let bytes = self.view(usize::try_from(accessor["bufferView"].as_u64().unwrap()).unwrap());
        bytes.as_chunks().0.iter().map(|&word| f32::from_le_bytes(word)).collect()
    }
}
