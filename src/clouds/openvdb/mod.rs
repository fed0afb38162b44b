//! OpenVDB volumes (.vdb): a grid of density as a dense box of voxels, without OpenVDB.
//!
//! Formats 222 to 224 (OpenVDB 12 writes 224): grids of float, double, int32 and int64, in
//! half precision too, all as `f32`; active and inactive tiles; any background; stored plainly, by zlib or by Blosc (LZ4
//! or zlib inside); several grids, shared trees (instances), streams without offsets; scale, translation and affine maps
//! whose axes are those of the world, in any order and direction. Frustums, turned maps, vectors, booleans and points are
//! refused by name. Voxel centres lie on whole indices. Values are exact for f32 and half; no bytes make it panic.
//! The format as measured on files of OpenVDB 10 and 12. Tests: `tests/oracles/test_openvdb.py` (values that OpenVDB 12
//! gives), `tests/hard/test_openvdb_hard.py` (every cut and thousands of mutations).
//! Cost: 256³ voxels of half (Blosc) in 0.11 s on one core.

mod bytes;
mod tree;

use crate::error::{Error, Result};
use crate::job::Job;
use bytes::{Cursor, bad};
use tree::{Extent, Layout, Number, Placing, Tree};

/// One grid of a file.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Its name; `name[1]` for a second one of that name.
    pub name: String,
    /// Type of its numbers as the file spells it: `float`, `vec3s`, …
    pub kind: String,
    /// `fog volume`, `level set`, `unknown`, …
    pub class: String,
    /// Kind of its map from indices to the world.
    pub map: String,
    /// Why it cannot be read; empty if it can.
    pub problem: String,
    key: String,
    parent: String,
    layout: Option<Layout>,
    affine: Option<[[f64; 3]; 4]>,
    topology: usize,
    values: Option<usize>,
}

/// The grids of a file.
#[derive(Debug)]
pub struct File<'a> {
    data: &'a [u8],
    /// In the file's order.
    pub entries: Vec<Entry>,
    /// Grids of a stream behind one that cannot be read.
    pub beyond: usize,
}

/// A dense box of voxels.
#[derive(Debug)]
pub struct Dense {
    /// Values, x fastest.
    pub values: Vec<f32>,
    /// Voxels along x, y, z.
    pub size: [usize; 3],
    /// Edges of a voxel along x, y, z, in units of the file's world.
    pub voxel: [f64; 3],
    /// Lowest corner.
    pub origin: [f64; 3],
    /// The value everywhere else.
    pub background: f32,
}

/// Past name, type and bytes of metadata; what the one called `class` says.
fn metadata(from: &mut Cursor<'_>) -> Result<String> {
    let mut class = String::from("unknown");
    for _ in 0..from.u32()? {
        let (name, kind) = (from.text()?, from.text()?);
        let length = from.u32()? as usize;
        let bytes = from.take(length)?;
        if name == "class" && kind == "string" {
            class = String::from_utf8_lossy(bytes).into_owned();
        }
    }
    Ok(class)
}

/// Rows of indices and the translation: world = index @ rows + translation. Nothing for a map that is not affine.
fn affine(from: &mut Cursor<'_>, map: &str) -> Result<Option<[[f64; 3]; 4]>> {
    let triple = |from: &mut Cursor<'_>| -> Result<[f64; 3]> { Ok([from.f64()?, from.f64()?, from.f64()?]) };
    let of = |scale: [f64; 3], shift| Some([[scale[0], 0.0, 0.0], [0.0, scale[1], 0.0], [0.0, 0.0, scale[2]], shift]);
    Ok(match map {
        "UniformScaleMap" | "ScaleMap" => {
            let scale = triple(from)?;
            from.take(8 * 12)?;
            of(scale, [0.0; 3])
        }
        "UniformScaleTranslateMap" | "ScaleTranslateMap" => {
            let (shift, scale) = (triple(from)?, triple(from)?);
            from.take(8 * 12)?;
            of(scale, shift)
        }
        "TranslationMap" => of([1.0; 3], triple(from)?),
        "AffineMap" | "UnitaryMap" => {
            let mut rows = [[0.0; 3]; 4];
            for row in &mut rows {
                *row = triple(from)?;
                from.f64()?;
            }
            Some(rows)
        }
        _ => None,
    })
}

/// The axis of the world along which each index runs, and the edge with its sign.
fn axes(rows: &[[f64; 3]; 4]) -> Option<[(usize, f64); 3]> {
    let mut out = [(0, 0.0); 3];
    for (row, found) in rows.iter().zip(&mut out) {
        let along = (0..3).max_by(|&a, &b| row[a].abs().total_cmp(&row[b].abs()))?;
        let edge = row[along];
        let others = (0..3).filter(|&k| k != along).all(|k| row[k].abs() <= 1e-6 * edge.abs());
        if !(others && edge.is_finite() && edge.abs() > 1e-9 && edge.abs() < 1e9) {
            return None;
        }
        *found = (along, edge);
    }
    let all = out.iter().fold(0, |seen, (k, _)| seen | 1 << k) == 7;
    (all && rows[3].iter().all(|v| v.abs() < 1e12)).then_some(out)
}

impl<'a> File<'a> {
    /// The list of a file's grids.
    pub fn open(data: &'a [u8], job: &Job) -> Result<Self> {
        let mut from = Cursor::new(data, 0)?;
        if from.i64().ok() != Some(0x5644_4220) {
            return Err(bad("is no OpenVDB file"));
        }
        let version = from.u32()?;
        if !(222..=224).contains(&version) {
            return Err(bad(format!("has version {version} of the format; 222 to 224 are read")));
        }
        from.take(8)?;
        let offsets = from.array::<1>()?[0] != 0;
        from.take(36)?;
        metadata(&mut from)?;
        let count = from.u32()? as usize;
        let mut file = Self { data, entries: Vec::new(), beyond: 0 };
        for k in 0..count {
            job.check()?;
            let (entry, next) = file.entry(&mut from, offsets, job)?;
            file.entries.push(entry);
            let Some(next) = next else {
                file.beyond = count - k - 1;
                break;
            };
            from = Cursor::new(data, next)?;
        }
        Ok(file)
    }

    /// One grid's description, and where the next begins if that can be known.
    fn entry(&self, from: &mut Cursor<'a>, offsets: bool, job: &Job) -> Result<(Entry, Option<usize>)> {
        let (key, tree, parent) = (from.text()?, from.text()?, from.text()?);
        let mut positions = [0; 3];
        for position in &mut positions {
            *position = usize::try_from(from.i64()?).map_err(|_| bad("is damaged: a negative offset"))?;
        }
        let here = from.position();
        if offsets {
            if positions[0] < here || positions[2] < positions[0] {
                return Err(bad("is damaged: offsets that go back"));
            }
            *from = Cursor::new(self.data, positions[0])?;
        }
        let compression = from.u32()?;
        let class = metadata(from)?;
        let map = from.text()?;
        let affine = affine(from, &map)?;
        let half = tree.ends_with("_HalfFloat");
        let plain = tree.trim_end_matches("_HalfFloat");
        let kind = plain.trim_start_matches("Tree_").trim_end_matches("_5_4_3").to_owned();
        let number = match plain {
            "Tree_float_5_4_3" => Some(Number::Single),
            "Tree_double_5_4_3" => Some(Number::Double),
            "Tree_int32_5_4_3" => Some(Number::Int32),
            "Tree_int64_5_4_3" => Some(Number::Int64),
            _ => None,
        };
        let layout = number.map(|number| Layout { number, half, compression });
        let problem = if layout.is_none() {
            format!("{kind} is no number for each voxel")
        } else if class == "level set" {
            "a level set is a distance to a surface and no density: convert it to a fog volume".to_owned()
        } else if affine.is_none() {
            format!("{map} is not affine: resample it")
        } else if affine.is_some_and(|rows| axes(&rows).is_none()) {
            format!("its {map} is turned, sheared or without volume: resample it along the axes of the world")
        } else {
            String::new()
        };
        let topology = from.position();
        let name = match key.split_once('\u{1e}') {
            Some((name, number)) => format!("{name}[{number}]"),
            None => key.clone(),
        };
        let values = offsets.then_some(positions[1]);
        let next = if offsets {
            Some(positions[2])
        } else if !parent.is_empty() {
            Some(topology)
        } else if let (Some(layout), true) = (layout, affine.is_some()) {
            let mut past = from.clone();
            Tree::topology(&mut past, layout, 1 << 32, job)?.skip(&mut past, layout)?;
            Some(past.position())
        } else {
            None
        };
        Ok((Entry { name, kind, class, map, problem, key, parent, layout, affine, topology, values }, next))
    }

    /// A grid as a dense box of at most `max_voxels` voxels; with `y_up` the world's y becomes height.
    pub fn read(&self, grid: usize, y_up: bool, max_voxels: u64, job: &Job) -> Result<Dense> {
        let entry = self.entries.get(grid).ok_or_else(|| bad(format!("has no grid {grid}")))?;
        let about = |error: Error| match error {
            Error::Data { name, reason } => Error::Data { name, reason: format!("{reason} (grid '{}')", entry.name) },
            other => other,
        };
        self.dense(entry, y_up, max_voxels, job).map_err(about)
    }

    fn dense(&self, entry: &Entry, y_up: bool, max_voxels: u64, job: &Job) -> Result<Dense> {
        let (Some(mut rows), true) = (entry.affine, entry.problem.is_empty()) else {
            return Err(bad(entry.problem.clone()));
        };
        if y_up {
            rows = rows.map(|[x, y, z]| [x, -z, y]);
        }
        let along = axes(&rows).ok_or_else(|| bad("has a map that is not along the axes"))?;
        let owner = if entry.parent.is_empty() {
            entry
        } else {
            let mut others = self.entries.iter().filter(|e| e.parent.is_empty());
            let found = others.find(|e| e.key == entry.parent || e.name == entry.parent);
            found.ok_or_else(|| bad(format!("shares the tree of '{}', which is not there", entry.parent)))?
        };
        let layout = owner.layout.ok_or_else(|| bad(owner.problem.clone()))?;
        let mut from = Cursor::new(self.data, owner.topology)?;
        let tree = Tree::topology(&mut from, layout, max_voxels.max(1 << 20), job)?;
        // A grid without voxels is one voxel of its background.
        let extent = tree.extent().unwrap_or(Extent { low: [0; 3], size: [1; 3] });
        let [nx, ny, nz] = extent.size;
        let voxels = nx.checked_mul(ny).and_then(|n| n.checked_mul(nz));
        let Some(voxels) = voxels.filter(|&n| n <= max_voxels && usize::try_from(n).is_ok()) else {
            let gigabytes = nx as f64 * ny as f64 * nz as f64 * 4e-9;
            return Err(bad(format!(
                "needs a box of {nx} x {ny} x {nz} voxels ({gigabytes:.3} GB); max_voxels is {max_voxels}"
            )));
        };
        if let Some(at) = owner.values {
            from = Cursor::new(self.data, at)?;
        }
        let (mut size, mut voxel, mut origin) = ([1; 3], [0.0; 3], [0.0; 3]);
        for (k, &(axis, edge)) in along.iter().enumerate() {
            size[axis] = extent.size[k] as usize;
            voxel[axis] = edge.abs();
            let last = extent.low[k] + extent.size[k] as i64 - 1;
            let lowest = if edge > 0.0 { extent.low[k] } else { last };
            origin[axis] = rows[3][axis] + (lowest as f64) * edge - 0.5 * edge.abs();
        }
        let strides = [1, size[0] as i64, (size[0] * size[1]) as i64];
        let mut placing = Placing { start: 0, step: [0; 3] };
        for (k, &(axis, edge)) in along.iter().enumerate() {
            placing.step[k] = if edge > 0.0 { strides[axis] } else { -strides[axis] };
            placing.start += if edge > 0.0 { 0 } else { (extent.size[k] as i64 - 1) * strides[axis] };
        }
        let mut values = Vec::new();
        let wanted = voxels as usize;
        values
            .try_reserve_exact(wanted)
            .map_err(|_| bad(format!("needs {wanted} voxels, for which there is no memory")))?;
        values.resize(wanted, 0.0);
        tree.fill(&mut from, layout, &extent, &placing, &mut values, job)?;
        Ok(Dense { values, size, voxel, origin, background: tree.background })
    }
}
