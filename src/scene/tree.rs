//! TOML as a tree that remembers where each value was typed, so that every complaint can name a line or an option.

use std::fmt;
use std::path::Path;

use crate::error::{Error, Result, did_you_mean};

/// A value and where it comes from.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub value: Value,
    pub place: Origin,
}

/// What TOML can hold; tables keep the order of the file.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Text(String),
    Integer(i64),
    Float(f64),
    Bool(bool),
    /// A date or an integer beyond 64 bits: nothing a scene asks for.
    Other(String),
    List(Vec<Node>),
    Table(Vec<(String, Node)>),
}

/// Where a value was typed.
#[derive(Clone, Debug)]
pub(super) enum Origin {
    /// A line of the scene file, from 1.
    Line(usize),
    /// An option `-D path=value`, as typed.
    Override(String),
}

impl Origin {
    /// The start of a message: `scenes/x.toml:7` or `-D a.b=c`.
    pub(super) fn within(&self, file: &Path) -> String {
        match self {
            Self::Line(line) => format!("{}:{line}", file.display()),
            Self::Override(typed) => format!("{} with -D {typed}", file.display()),
        }
    }
}

impl Node {
    /// The tree of a whole file.
    pub(super) fn parse(text: &str, file: &Path) -> Result<Self> {
        let breaks: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
        let line = |offset: usize| 1 + breaks.partition_point(|&at| at < offset);
        let table = toml::de::DeTable::parse(text).map_err(|e| {
            let at = e.span().map_or(String::new(), |span| format!(":{}", line(span.start)));
            Error::scene(format!("{}{at}: not TOML: {}", file.display(), e.message()))
        })?;
        Ok(Self { value: from_table(table.get_ref(), &|offset| Origin::Line(line(offset))), place: Origin::Line(1) })
    }

    /// Puts the value of `path.to.key=value` in its place. The value is read as TOML, and as text if it is none.
    pub(super) fn set(&mut self, typed: &str) -> Result<()> {
        let usage = |what: &str| Error::usage(format!("-D {typed}: {what}"));
        let (path, text) = typed.split_once('=').ok_or_else(|| usage("expected path.to.key=value"))?;
        let place = Origin::Override(typed.to_string());
        let keys: Vec<&str> = path.trim().split('.').map(str::trim).collect();
        if keys.contains(&"") {
            return Err(usage("expected path.to.key=value"));
        }
        let mut node = self;
        for (depth, key) in keys.iter().enumerate() {
            let so_far = keys[..depth].join(".");
            let empty = || Self { value: Value::Table(Vec::new()), place: place.clone() };
            node = match &mut node.value {
                Value::Table(entries) => {
                    let found = entries.iter().position(|(name, _)| name == key).unwrap_or_else(|| {
                        entries.push((key.to_string(), empty()));
                        entries.len() - 1
                    });
                    &mut entries[found].1
                }
                Value::List(items) => {
                    let n = items.len();
                    let item = key.parse::<usize>().ok().and_then(|i| items.get_mut(i));
                    item.ok_or_else(|| usage(&format!("`{so_far}` is a list of {n}; expected a number below {n}")))?
                }
                other => return Err(usage(&format!("`{so_far}` is {}, and has no `{key}`", shown(other)))),
            };
        }
        *node = Self { value: override_value(text.trim(), &place), place };
        Ok(())
    }

    /// The tree as TOML again, for logs and file headers.
    pub(super) fn to_toml(&self) -> toml::Value {
        match &self.value {
            Value::Text(text) | Value::Other(text) => toml::Value::String(text.clone()),
            Value::Integer(i) => toml::Value::Integer(*i),
            Value::Float(f) => toml::Value::Float(*f),
            Value::Bool(b) => toml::Value::Boolean(*b),
            Value::List(items) => toml::Value::Array(items.iter().map(Self::to_toml).collect()),
            Value::Table(entries) => {
                toml::Value::Table(entries.iter().map(|(key, node)| (key.clone(), node.to_toml())).collect())
            }
        }
    }

    /// The number, whole or not.
    pub(super) fn number(&self) -> Option<f64> {
        match self.value {
            Value::Integer(i) => Some(i as f64),
            Value::Float(f) if f.is_finite() => Some(f),
            _ => None,
        }
    }

    /// The whole number.
    pub(super) fn integer(&self) -> Option<i64> {
        if let Value::Integer(i) = self.value { Some(i) } else { None }
    }

    /// The text.
    pub(super) fn text(&self) -> Option<&str> {
        if let Value::Text(text) = &self.value { Some(text) } else { None }
    }

    /// The value in a message.
    pub(super) fn shown(&self) -> String {
        shown(&self.value)
    }

    /// Exactly `N` finite numbers.
    pub(super) fn numbers<const N: usize>(&self) -> Option<[f64; N]> {
        let Value::List(items) = &self.value else { return None };
        items.iter().map(Self::number).collect::<Option<Vec<f64>>>()?.try_into().ok()
    }
}

impl Value {
    /// Whether both were typed with the same meaning; lists by their items, in order.
    pub(super) fn same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Text(a), Self::Text(b)) | (Self::Other(a), Self::Other(b)) => a == b,
            (Self::Integer(a), Self::Integer(b)) => a == b,
            (Self::Float(a), Self::Float(b)) => a.to_bits() == b.to_bits(),
            (Self::Bool(a), Self::Bool(b)) => a == b,
            (Self::List(a), Self::List(b)) => {
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.value.same(&b.value))
            }
            (Self::Table(a), Self::Table(b)) => {
                a.len() == b.len() && a.iter().all(|(k, v)| b.iter().any(|(l, w)| k == l && v.value.same(&w.value)))
            }
            // A date becomes a text when it is written again.
            (Self::Other(a), Self::Text(b)) | (Self::Text(a), Self::Other(b)) => a == b,
            _ => false,
        }
    }
}

fn override_value(text: &str, place: &Origin) -> Value {
    let line = format!("x = {text}");
    if let Ok(table) = toml::de::DeTable::parse(&line)
        && table.get_ref().len() == 1
        && let Some((_, value)) = table.get_ref().iter().next()
    {
        return from_value(value.get_ref(), &|_| place.clone());
    }
    Value::Text(text.to_string())
}

fn from_table(table: &toml::de::DeTable<'_>, place: &dyn Fn(usize) -> Origin) -> Value {
    let mut entries: Vec<_> = table
        .iter()
        .map(|(key, value)| {
            // The key's own line: a table's span may begin elsewhere.
            let node = Node { value: from_value(value.get_ref(), place), place: place(key.span().start) };
            (key.span().start, key.get_ref().to_string(), node)
        })
        .collect();
    entries.sort_by_key(|(start, ..)| *start);
    Value::Table(entries.into_iter().map(|(_, key, node)| (key, node)).collect())
}

fn from_value(value: &toml::de::DeValue<'_>, place: &dyn Fn(usize) -> Origin) -> Value {
    use toml::de::DeValue as V;
    match value {
        V::String(text) => Value::Text(text.to_string()),
        V::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).map_or(Value::Other(i.to_string()), Value::Integer),
        V::Float(f) => f.as_str().parse().map_or(Value::Other(f.as_str().to_string()), Value::Float),
        V::Boolean(b) => Value::Bool(*b),
        V::Datetime(date) => Value::Other(date.to_string()),
        V::Array(items) => Value::List(
            items
                .iter()
                .map(|item| Node { value: from_value(item.get_ref(), place), place: place(item.span().start) })
                .collect(),
        ),
        V::Table(table) => from_table(table, place),
    }
}

/// A value in a message, cut short.
fn shown(value: &Value) -> String {
    match value {
        Value::Text(text) => format!("the text {:?}", text.chars().take(60).collect::<String>()),
        Value::Integer(i) => i.to_string(),
        Value::Float(f) => format!("{f:?}"),
        Value::Bool(b) => b.to_string(),
        Value::Other(text) => text.clone(),
        Value::Table(_) => "a table".into(),
        Value::List(items) if items.len() > 4 => format!("a list of {}", items.len()),
        Value::List(items) => {
            format!("[{}]", items.iter().map(|n| shown(&n.value)).collect::<Vec<_>>().join(", "))
        }
    }
}

/// A table being read: knows its keys, and says where and what when one is wrong.
#[derive(Clone)]
pub(super) struct Fields<'a> {
    file: &'a Path,
    /// Dotted path, empty for the file itself.
    path: String,
    entries: &'a [(String, Node)],
    place: &'a Origin,
}

impl<'a> Fields<'a> {
    /// `node` as a table called `path`.
    pub(super) fn open(file: &'a Path, path: String, node: &'a Node) -> Result<Self> {
        let Value::Table(entries) = &node.value else {
            let at = node.place.within(file);
            return Err(Error::scene(format!("{at}: `{path}` is {}; expected a table", shown(&node.value))));
        };
        Ok(Self { file, path, entries, place: &node.place })
    }

    /// Refuses every key that is not in `known`; `what` completes "... is not a key of ...".
    pub(super) fn only(&self, what: &str, known: &[&str]) -> Result<()> {
        let Some((key, node)) = self.entries.iter().find(|(key, _)| !known.contains(&key.as_str())) else {
            return Ok(());
        };
        let hint = did_you_mean(key, known.iter().copied());
        let at = node.place.within(self.file);
        Err(Error::scene(format!("{at}: `{key}` is not a key of {what}{hint}; there are {}", known.join(", "))))
    }

    /// All keys with their tables, in the order of the file.
    pub(super) fn tables(&self) -> impl Iterator<Item = Result<(&'a str, Self)>> + '_ {
        self.entries.iter().map(|(key, node)| Ok((key.as_str(), Self::open(self.file, self.dotted(key), node)?)))
    }

    /// The table under `key`, if it is there.
    pub(super) fn table(&self, key: &str) -> Result<Option<Self>> {
        self.node(key).map(|node| Self::open(self.file, self.dotted(key), node)).transpose()
    }

    /// The list of tables under `key`; empty if it is not there.
    pub(super) fn list(&self, key: &str) -> Result<Vec<Self>> {
        let Some(node) = self.node(key) else { return Ok(Vec::new()) };
        let Value::List(items) = &node.value else {
            return Err(self.wrong(key, &format!("a list of tables, each headed [[{key}]]")));
        };
        items.iter().zip(0..).map(|(item, i)| Self::open(self.file, format!("{key}.{i}"), item)).collect()
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.node(key).is_some()
    }

    /// Whether there is a table under `key`.
    pub(super) fn is_table(&self, key: &str) -> bool {
        self.node(key).is_some_and(|node| matches!(node.value, Value::Table(_)))
    }

    /// All keys, in the order of the file.
    pub(super) fn keys(&self) -> impl Iterator<Item = &'a str> {
        self.entries.iter().map(|(key, _)| key.as_str())
    }

    /// The value of `key` where `convert` takes it; `expected` says what it takes.
    pub(super) fn get<T>(
        &self,
        key: &str,
        expected: &str,
        convert: impl FnOnce(&'a Node) -> Option<T>,
    ) -> Result<Option<T>> {
        let Some(node) = self.node(key) else { return Ok(None) };
        convert(node).map(Some).ok_or_else(|| self.wrong(key, expected))
    }

    /// As [`Self::get`], for a key that has no default.
    pub(super) fn need<T>(&self, key: &str, expected: &str, convert: impl FnOnce(&'a Node) -> Option<T>) -> Result<T> {
        self.get(key, expected, convert)?.ok_or_else(|| self.missing(key, expected))
    }

    /// That `key` is not there.
    pub(super) fn missing(&self, key: &str, expected: &str) -> Error {
        self.error(format_args!("`{}` is missing; expected {expected}", self.dotted(key)))
    }

    /// That the value of `key` will not do.
    pub(super) fn wrong(&self, key: &str, expected: &str) -> Error {
        let found = self.node(key).map_or("missing".into(), |node| shown(&node.value));
        self.error_at(key, format_args!("is {found}; expected {expected}"))
    }

    /// Something about the value of `key`: `what` follows its name.
    pub(super) fn error_at(&self, key: &str, what: impl fmt::Display) -> Error {
        let place = self.node(key).map_or(self.place, |node| &node.place);
        Error::scene(format!("{}: `{}` {what}", place.within(self.file), self.dotted(key)))
    }

    /// Something about the table as a whole.
    pub(super) fn error(&self, what: impl fmt::Display) -> Error {
        Error::scene(format!("{}: {what}", self.at()))
    }

    /// Where the table begins, for messages of later checks.
    pub(super) fn at(&self) -> String {
        self.place.within(self.file)
    }

    /// Where `key` is, or else the table.
    pub(super) fn at_key(&self, key: &str) -> String {
        self.node(key).map_or(self.place, |node| &node.place).within(self.file)
    }

    fn node(&self, key: &str) -> Option<&'a Node> {
        self.entries.iter().find(|(name, _)| name == key).map(|(_, node)| node)
    }

    fn dotted(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_string() } else { format!("{}.{key}", self.path) }
    }
}
