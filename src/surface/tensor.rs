//! Files of named arrays, as those of measured materials are (the RGL material database, Dupuy and
//! Jakob 2018; `tensor_file`, version 1.0).

/// Arrays of a file, which stay in its bytes.
pub struct Tensors<'a> {
    bytes: &'a [u8],
    fields: Vec<Field>,
}

struct Field {
    name: String,
    floats: bool,
    shape: Vec<usize>,
    offset: usize,
}

/// Arrays at most.
const MOST_FIELDS: u32 = 64;

/// Dimensions at most.
const MOST_DIMENSIONS: usize = 8;

/// The type of `f32`.
const FLOAT: u8 = 10;

struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = (self.0.split_at_checked(count)).ok_or("is cut short in its list")?;
        self.0 = rest;
        Ok(taken)
    }

    /// Little endian.
    fn number(&mut self, bytes: usize) -> Result<u64, String> {
        let digits = self.take(bytes)?.iter().rev();
        Ok(digits.fold(0, |n, b| n << 8 | u64::from(*b)))
    }

    fn size(&mut self) -> Result<usize, String> {
        usize::try_from(self.number(8)?).map_err(|_| "has an array without end".into())
    }
}

impl<'a> Tensors<'a> {
    /// What the head of a file says of its arrays; or what is wrong with it.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, String> {
        let mut reader = Reader(bytes);
        let head = reader.take(14).unwrap_or_default();
        if head != b"tensor_file\0\x01\0" {
            return Err("is no measured BSDF (\"tensor_file\", version 1.0)".into());
        }
        let count = reader.number(4)? as u32;
        if count > MOST_FIELDS {
            return Err(format!("has {count} arrays; {MOST_FIELDS} are possible"));
        }
        let mut fields = Vec::new();
        for _ in 0..count {
            let length = reader.number(2)? as usize;
            let name = String::from_utf8_lossy(reader.take(length)?).into_owned();
            let dimensions = reader.number(2)? as usize;
            let floats = reader.number(1)? == u64::from(FLOAT);
            let offset = reader.size()?;
            if dimensions > MOST_DIMENSIONS {
                return Err(format!(
                    "has an array \"{name}\" of {dimensions} dimensions"
                ));
            }
            let shape = (0..dimensions).map(|_| reader.size());
            let shape = shape.collect::<Result<Vec<_>, _>>()?;
            fields.push(Field {
                name,
                floats,
                shape,
                offset,
            });
        }
        Ok(Self { bytes, fields })
    }

    /// An array of finite numbers and its shape, of `N` dimensions.
    pub fn floats<const N: usize>(&self, name: &str) -> Result<(Vec<f32>, [usize; N]), String> {
        let field = self.fields.iter().find(|f| f.name == name);
        let field = field.ok_or_else(|| format!("has no array \"{name}\""))?;
        let shape: [usize; N] = match (field.floats, field.shape.as_slice().try_into()) {
            (true, Ok(shape)) => shape,
            _ => {
                return Err(format!(
                    "has an array \"{name}\" that is not of {N} dimensions"
                ));
            }
        };
        let count = shape.iter().try_fold(1usize, |n, s| n.checked_mul(*s));
        let part = count.and_then(|count| {
            let end = field.offset.checked_add(count.checked_mul(4)?)?;
            self.bytes.get(field.offset..end)
        });
        let part = part.ok_or_else(|| format!("is cut short in \"{name}\""))?;
        let words = part.chunks_exact(4);
        let values: Vec<f32> = words
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect();
        match values.iter().all(|v| v.is_finite()) {
            true => Ok((values, shape)),
            false => Err(format!("has values in \"{name}\" that are no numbers")),
        }
    }
}
