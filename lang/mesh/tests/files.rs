//! Meshes from files, and what is said of files that are none.

use matterix_mesh::read;
use proptest::prelude::*;

/// Corners and triangles of a box of 40 x 20 x 10, from (5, 5, 5), counter-clockwise seen from outside.
fn block() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let corner = |i: u32| [5.0 + 40.0 * (i & 1) as f32, 5.0 + 20.0 * (i >> 1 & 1) as f32, 5.0 + 10.0 * (i >> 2) as f32];
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let halves = sides.iter().flat_map(|s| [[s[0], s[1], s[2]], [s[0], s[2], s[3]]]);
    ((0..8).map(corner).collect(), halves.collect())
}

fn binary_stl() -> Vec<u8> {
    let (points, triangles) = block();
    let mut out = b"solid by a program that writes this word into binary files".to_vec();
    out.resize(80, b' ');
    out.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        out.extend([0; 12]);
        let corners = triangle.iter().flat_map(|i| points[*i as usize]);
        out.extend(corners.flat_map(f32::to_le_bytes));
        out.extend([0; 2]);
    }
    out
}

fn text_stl() -> Vec<u8> {
    let (points, triangles) = block();
    let mut out = "solid block\n".to_string();
    for triangle in triangles {
        out += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in triangle.map(|i| points[i as usize]) {
            out += &format!("vertex {x} {y} {z}\n");
        }
        out += "endloop\nendfacet\n";
    }
    (out + "endsolid block\n").into_bytes()
}

fn obj() -> Vec<u8> {
    let (points, triangles) = block();
    let points: String = points.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    let faces: String = triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1)).collect();
    format!("{points}{faces}").into_bytes()
}

/// In metres and with y up, moved by a node.
fn gltf() -> Vec<u8> {
    use base64::Engine;
    let (points, triangles) = block();
    let swung = points.iter().map(|[x, y, z]| [x / 1e3 - 1.0, z / 1e3, -y / 1e3]);
    let mut data: Vec<u8> = swung.flatten().flat_map(f32::to_le_bytes).collect();
    let first = data.len();
    data.extend(triangles.iter().flatten().flat_map(|i| i.to_le_bytes()));
    let coded = base64::engine::general_purpose::STANDARD.encode(&data);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0,"translation":[1,0,0]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "buffers":[{{"byteLength":{},"uri":"data:application/octet-stream;base64,{coded}"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{first}}},{{"buffer":0,"byteOffset":{first},"byteLength":{}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3","min":[-1,-1,-1],"max":[1,1,1]}},
        {{"bufferView":1,"componentType":5125,"count":36,"type":"SCALAR"}}]}}"#,
        data.len(),
        data.len() - first
    )
    .into_bytes()
}

#[test]
fn one_body_is_the_same_from_all_kinds_of_files() {
    let files =
        [("a.stl", binary_stl(), 1e-3), ("b.STL", text_stl(), 1e-3), ("c.obj", obj(), 1e-3), ("d.gltf", gltf(), 1.0)];
    for (name, bytes, unit) in files {
        let mesh = read(name, &bytes).unwrap_or_else(|why| panic!("{name}: {why}")).scaled([unit; 3]);
        assert_eq!((mesh.points.len(), mesh.triangles.len()), (8, 12), "{name}");
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-7);
        let [low, high] = mesh.bounds();
        assert!(near(low, [0.005; 3]) && near(high, [0.045, 0.025, 0.015]), "{name}: {low:?} {high:?}");
        let [low, high] = mesh.grounded().bounds();
        assert!(near(low, [-0.02, -0.01, 0.0]) && near(high, [0.02, 0.01, 0.01]), "{name}: {low:?} {high:?}");
    }
}

#[test]
fn what_is_wrong_is_said() {
    let flat = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let cases: [(&str, &[u8], &str); 7] = [
        ("a.dae", b"", "supported formats are"),
        ("a.stl", b"hello", "neither starts with `solid`"),
        ("a.stl", b"solid x\nfacet normal 0 0", "it is not an STL file"),
        ("a.obj", b"v 0 0\nf 1 2 3\n", "it is not an OBJ file"),
        ("a.obj", b"# nothing\n", "no triangles"),
        ("a.obj", flat, "flat"),
        ("a.gltf", b"{}", "it is not a glTF file"),
    ];
    for (name, bytes, expected) in cases {
        let said = read(name, bytes).expect_err(name);
        assert!(said.contains(expected), "{name}: {said}");
    }
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400), kind in 0..4usize) {
        let _ = read(["a.stl", "a.obj", "a.glb", "a.gltf"][kind], &bytes);
    }

    #[test]
    fn damaged_files_do_not_make_it_panic(at in any::<prop::sample::Index>(), by in any::<u8>(), cut in any::<prop::sample::Index>(), kind in 0..4usize) {
        let (name, mut bytes) = [("a.stl", binary_stl()), ("a.stl", text_stl()), ("a.obj", obj()), ("a.gltf", gltf())][kind].clone();
        let place = at.index(bytes.len());
        bytes[place] = by;
        let _ = read(name, &bytes);
        bytes.truncate(cut.index(bytes.len()));
        let _ = read(name, &bytes);
    }
}

/// The block of the other tests, in metres and with z up, as text; with y up, its corners counted the other way round and in an
/// archive that refers to it, as Pixar's own library wrote it (`tests/usd/make.py`).
const USD: [(&str, &[u8]); 3] = [
    ("block.usda", include_bytes!("usd/block.usda")),
    ("block.usdc", include_bytes!("usd/block.usdc")),
    ("block.usdz", include_bytes!("usd/block.usdz")),
];

#[cfg(not(feature = "usd"))]
#[test]
fn without_the_feature_it_is_said_how_to_read_usd() {
    for (name, bytes) in USD {
        assert_eq!(matterix_mesh::is_metric(name), Some(true));
        let said = read(name, bytes).expect_err(name);
        assert!(said.contains("--features usd"), "{name}: {said}");
    }
}

#[cfg(feature = "usd")]
mod usd {
    use super::*;

    /// The volume within triangles, m3: below 0 where they are inside out.
    fn volume(mesh: &matterix_ir::mesh::Mesh) -> f64 {
        let corner = |i: u32| mesh.points[i as usize];
        let sixfold = |[a, b, c]: [[f64; 3]; 3]| {
            a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        mesh.triangles.iter().map(|t| sixfold(t.map(corner)) / 6.0).sum()
    }

    #[test]
    fn all_kinds_of_usd_give_the_same_body() {
        for (name, bytes) in USD {
            let mesh = read(name, bytes).unwrap_or_else(|why| panic!("{name}: {why}"));
            assert_eq!((mesh.points.len(), mesh.triangles.len()), (8, 12), "{name}");
            let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-7);
            let [low, high] = mesh.bounds();
            assert!(near(low, [0.005; 3]) && near(high, [0.045, 0.025, 0.015]), "{name}: {low:?} {high:?}");
            assert!((volume(&mesh) - 8e-6).abs() < 1e-10, "{name}: {} m3", volume(&mesh));
        }
    }

    #[test]
    fn what_is_wrong_with_usd_is_said() {
        let elsewhere = b"#usda 1.0\n(\n    subLayers = [@other.usda@]\n)\n";
        let short = b"#usda 1.0\ndef Mesh \"m\"\n{\n    int[] faceVertexCounts = [3]\n    int[] faceVertexIndices = [0, 1]\n    point3f[] points = [(0, 0, 0)]\n}\n";
        let cases: [(&str, &[u8], &str); 5] = [
            ("a.usda", b"hello", "not a USD file"),
            ("a.usdc", b"PXR-USDC", "not a USD file"),
            ("a.usdz", b"PK", "not a USD file"),
            ("a.usda", elsewhere, "other.usda"),
            ("a.usda", short, "lacks corners"),
        ];
        for (name, bytes, expected) in cases {
            let said = read(name, bytes).expect_err(name);
            assert!(said.contains(expected), "{name}: {said}");
        }
        assert!(read("a.usda", b"#usda 1.0\n").expect_err("nothing").contains("no triangles"));
    }

    // Of binary files openusd 0.6 sets memory aside by what they claim, and ends the program where that is not to be had.
    proptest! {
        #[test]
        fn damaged_usd_does_not_make_it_panic(at in any::<prop::sample::Index>(), by in any::<u8>(), cut in any::<prop::sample::Index>()) {
            let (name, bytes) = USD[0];
            let mut bytes = bytes.to_vec();
            let place = at.index(bytes.len());
            bytes[place] = by;
            let _ = read(name, &bytes);
            bytes.truncate(cut.index(bytes.len()));
            let _ = read(name, &bytes);
        }
    }
}
