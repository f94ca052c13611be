//! Wraps the C++ side in safe types; shim.hpp has the same declarations.

#![expect(unsafe_code, reason = "OpenCASCADE is C++, reached through C functions")]

use std::ffi::{CStr, c_char};
use std::ptr::NonNull;

use lamp_brep::Jet;

mod raw {
    use std::ffi::{c_char, c_void};
    use std::marker::{PhantomData, PhantomPinned};

    /// An opaque type of the C++ side.
    #[repr(C)]
    pub(super) struct Model {
        _data: [u8; 0],
        _marker: PhantomData<(*mut u8, PhantomPinned)>,
    }

    /// An opaque type of the C++ side.
    #[repr(C)]
    pub(super) struct Mesh {
        _data: [u8; 0],
        _marker: PhantomData<(*mut u8, PhantomPinned)>,
    }

    #[repr(C)]
    pub(super) struct Error {
        pub(super) text: [c_char; 256],
    }

    #[derive(Clone, Copy)]
    #[repr(C)]
    pub(super) struct List {
        pub(super) data: *const c_void,
        pub(super) count: usize,
    }

    unsafe extern "C" {
        pub(super) fn lamp_occt_read(
            bytes: *const u8,
            count: usize,
            heal_mm: f64,
            error: *mut Error,
        ) -> *mut Model;
        pub(super) fn lamp_occt_read_iges(
            path: *const c_char,
            heal_mm: f64,
            error: *mut Error,
        ) -> *mut Model;
        pub(super) fn lamp_occt_free(model: *mut Model);
        pub(super) fn lamp_occt_bodies(model: *const Model) -> usize;
        pub(super) fn lamp_occt_name(model: *const Model, body: usize) -> List;
        pub(super) fn lamp_occt_unit(model: *const Model) -> List;
        pub(super) fn lamp_occt_faces(model: *const Model) -> List;
        pub(super) fn lamp_occt_curves(model: *const Model) -> List;
        pub(super) fn lamp_occt_evaluate(
            model: *const Model,
            face: usize,
            uv: *const f64,
            count: usize,
            jets: *mut f64,
        );
        pub(super) fn lamp_occt_mesh(
            model: *const Model,
            chord_mm: f64,
            parallel: bool,
            error: *mut Error,
        ) -> *mut Mesh;
        pub(super) fn lamp_occt_mesh_free(mesh: *mut Mesh);
        pub(super) fn lamp_occt_nodes(mesh: *const Mesh) -> List;
        pub(super) fn lamp_occt_triangles(mesh: *const Mesh) -> List;
        pub(super) fn lamp_occt_chains(mesh: *const Mesh) -> List;
        pub(super) fn lamp_occt_chain_nodes(mesh: *const Mesh) -> List;
        pub(super) fn lamp_occt_faults(mesh: *const Mesh) -> List;
    }
}

/// A face.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Face {
    /// A value of `GeomAbs_SurfaceType`.
    pub(super) kind: u32,
    pub(super) body: u32,
    /// The entity's number in the file, or 0.
    pub(super) entity: u64,
    pub(super) has_box: u64,
    pub(super) box_mm: [[f64; 3]; 2],
    /// The ranges of u and of v.
    pub(super) range: [[f64; 2]; 2],
}

/// A corner of a face's facets.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Node {
    pub(super) point: [f64; 3],
    pub(super) uv: [f64; 2],
    pub(super) face: u64,
}

/// The nodes of one face along one edge, in the edge's direction.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Chain {
    pub(super) face: u32,
    pub(super) edge: u32,
    /// The vertices at the edge's ends, or `u32::MAX`.
    pub(super) ends: [u32; 2],
    /// The position of its first node in the nodes of all chains.
    pub(super) first: u32,
    pub(super) count: u32,
}

/// A face with faults.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Fault {
    pub(super) face: u32,
    /// Bits of `IMeshData_Status`; the highest is set if there are no facets.
    pub(super) status: u32,
}

/// Returns the values of a list.
///
/// # Safety
/// The list holds values of this type, which live and do not change while the owner is
/// borrowed.
unsafe fn values<T, O>(_owner: &O, list: raw::List) -> &[T] {
    if list.count == 0 {
        return &[];
    }
    // SAFETY: the caller guarantees it. A vector's values are aligned and contiguous.
    unsafe { std::slice::from_raw_parts(list.data.cast(), list.count) }
}

/// Returns the message of an error.
fn failed(error: &raw::Error) -> String {
    // SAFETY: the text is zero-filled at first and zero-terminated when written; it
    // outlives the call.
    let text = unsafe { CStr::from_ptr(error.text.as_ptr()) };
    text.to_string_lossy().into_owned()
}

const NO_ERROR: raw::Error = raw::Error { text: [0 as c_char; 256] };

/// A model of the C++ side.
pub(super) struct Model {
    raw: NonNull<raw::Model>,
    faces: usize,
}

// SAFETY: nothing in it is bound to a thread; OpenCASCADE counts references atomically.
unsafe impl Send for Model {}
// SAFETY: all calls only read it, except meshing, which locks it and changes nothing that other
// calls read. Surfaces are evaluated without a cache.
unsafe impl Sync for Model {}

impl Model {
    /// Reads the text of a STEP file, closing gaps up to a tolerance if it is above zero.
    pub(super) fn read(bytes: &[u8], heal_mm: f64) -> Result<Self, String> {
        let mut error = NO_ERROR;
        // SAFETY: the bytes and the error outlive the call; nothing keeps them.
        let raw =
            unsafe { raw::lamp_occt_read(bytes.as_ptr(), bytes.len(), heal_mm, &raw mut error) };
        Self::made(raw, &error)
    }

    /// Reads an IGES file, closing gaps up to a tolerance if it is above the one that the file states.
    pub(super) fn read_iges(path: &CStr, heal_mm: f64) -> Result<Self, String> {
        let mut error = NO_ERROR;
        // SAFETY: the path is zero-terminated; it and the error outlive the call, and nothing keeps them.
        let raw = unsafe { raw::lamp_occt_read_iges(path.as_ptr(), heal_mm, &raw mut error) };
        Self::made(raw, &error)
    }

    /// Takes a model of the C++ side, or the error that it left.
    fn made(raw: *mut raw::Model, error: &raw::Error) -> Result<Self, String> {
        let raw = NonNull::new(raw).ok_or_else(|| failed(error))?;
        let mut model = Self { raw, faces: 0 };
        model.faces = model.faces().len();
        Ok(model)
    }

    /// Returns the names of the bodies.
    pub(super) fn names(&self) -> Vec<String> {
        // SAFETY: the model is alive; below, `body` is less than this count.
        let count = unsafe { raw::lamp_occt_bodies(self.raw.as_ptr()) };
        let name = |body| {
            // SAFETY: as above; the model owns the name's bytes and does not change.
            let list = unsafe { raw::lamp_occt_name(self.raw.as_ptr(), body) };
            // SAFETY: as above.
            String::from_utf8_lossy(unsafe { values(self, list) }).into_owned()
        };
        (0..count).map(name).collect()
    }

    /// Returns the file's length unit.
    pub(super) fn unit(&self) -> String {
        // SAFETY: the model owns the bytes, is alive and does not change.
        let list = unsafe { raw::lamp_occt_unit(self.raw.as_ptr()) };
        // SAFETY: as above.
        String::from_utf8_lossy(unsafe { values(self, list) }).into_owned()
    }

    /// Returns the faces, body after body.
    pub(super) fn faces(&self) -> Vec<Face> {
        // SAFETY: the model owns the list, is alive and does not change.
        let list = unsafe { raw::lamp_occt_faces(self.raw.as_ptr()) };
        // SAFETY: it holds faces.
        unsafe { values(self, list) }.to_vec()
    }

    /// Returns the numbers of curves and points that bound no face, of an IGES file.
    pub(super) fn curves(&self) -> Vec<u64> {
        // SAFETY: the model owns the list, is alive and does not change.
        let list = unsafe { raw::lamp_occt_curves(self.raw.as_ptr()) };
        // SAFETY: it holds numbers of this size.
        unsafe { values(self, list) }.to_vec()
    }

    /// Evaluates a face's surface.
    ///
    /// # Panics
    /// Panics if the face does not exist, or the lists differ in length.
    pub(super) fn evaluate(&self, face: usize, uv: &[[f64; 2]], jets: &mut [Jet]) {
        assert!(face < self.faces, "there is no face {face}");
        assert_eq!(uv.len(), jets.len(), "as many jets as parameters");
        let (at, to) = (uv.as_ptr().cast(), jets.as_mut_ptr().cast());
        // SAFETY: the face exists; `uv.len()` pairs are read, and as many jets of nine
        // numbers written.
        unsafe { raw::lamp_occt_evaluate(self.raw.as_ptr(), face, at, uv.len(), to) };
    }

    /// Tessellates the model.
    pub(super) fn mesh(&self, chord_mm: f64, parallel: bool) -> Result<Mesh, String> {
        let mut error = NO_ERROR;
        // SAFETY: the model and the error outlive the call; the C++ side locks the model.
        let raw =
            unsafe { raw::lamp_occt_mesh(self.raw.as_ptr(), chord_mm, parallel, &raw mut error) };
        NonNull::new(raw).map(Mesh).ok_or_else(|| failed(&error))
    }
}

impl Drop for Model {
    fn drop(&mut self) {
        // SAFETY: it was made by the C++ side, and is freed once.
        unsafe { raw::lamp_occt_free(self.raw.as_ptr()) };
    }
}

/// Immutable facets of the C++ side.
pub(super) struct Mesh(NonNull<raw::Mesh>);

impl Mesh {
    /// Returns the corners of facets, face after face.
    pub(super) fn nodes(&self) -> &[Node] {
        // SAFETY: the list is the mesh's, which is borrowed, and holds nodes.
        unsafe { self.list(raw::lamp_occt_nodes) }
    }

    /// Returns the facets as three nodes each, face after face.
    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        // SAFETY: the list is the mesh's, which is borrowed, and holds three numbers each.
        unsafe { self.list(raw::lamp_occt_triangles) }
    }

    /// Returns the edges of faces.
    pub(super) fn chains(&self) -> &[Chain] {
        // SAFETY: the list is the mesh's, which is borrowed, and holds chains.
        unsafe { self.list(raw::lamp_occt_chains) }
    }

    /// Returns the nodes of a chain.
    pub(super) fn of_chain(&self, chain: &Chain) -> &[u32] {
        // SAFETY: the list is the mesh's, which is borrowed, and holds numbers.
        let all: &[u32] = unsafe { self.list(raw::lamp_occt_chain_nodes) };
        &all[chain.first as usize..][..chain.count as usize]
    }

    /// Returns the faces with faults.
    pub(super) fn faults(&self) -> &[Fault] {
        // SAFETY: the list is the mesh's, which is borrowed, and holds faults.
        unsafe { self.list(raw::lamp_occt_faults) }
    }

    /// Returns a list of the mesh.
    ///
    /// # Safety
    /// The list holds values of this type, owned by the mesh.
    unsafe fn list<T>(&self, of: unsafe extern "C" fn(*const raw::Mesh) -> raw::List) -> &[T] {
        // SAFETY: the mesh lives, and does not change until it is dropped.
        unsafe { values(self, of(self.0.as_ptr())) }
    }
}

impl Drop for Mesh {
    fn drop(&mut self) {
        // SAFETY: it was made by the C++ side, and is freed once.
        unsafe { raw::lamp_occt_mesh_free(self.0.as_ptr()) };
    }
}
