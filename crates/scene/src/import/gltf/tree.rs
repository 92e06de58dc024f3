//! Members of a document's tree.

use gltf::json::Value;

/// Element and message of a warning or an error.
pub(super) type Note = (String, String);

pub(super) fn list<'a>(value: &'a mut Value, name: &str) -> Option<&'a mut Vec<Value>> {
    value.get_mut(name)?.as_array_mut()
}

pub(super) fn items<'a>(value: &'a mut Value, name: &str) -> impl Iterator<Item = (usize, &'a mut Value)> {
    list(value, name).into_iter().flatten().enumerate()
}

/// Whether there was such a member.
pub(super) fn remove(value: &mut Value, name: &str) -> bool {
    value
        .as_object_mut()
        .is_some_and(|object| object.remove(name).is_some())
}

pub(super) fn insert(value: &mut Value, name: &str, member: Value) {
    if let Some(object) = value.as_object_mut() {
        object.insert(name.to_owned(), member);
    }
}
