//! The codec `lz4` of numcodecs: the length, as four bytes, then a block.

use std::borrow::Cow;
use std::sync::{Arc, Once};

use zarrs::array::{
    ArrayBytesRaw, BytesRepresentation, BytesToBytesCodecTraits, Codec, CodecError, CodecMetadataOptions,
    CodecOptions, CodecTraits, RecommendedConcurrency,
};
use zarrs::metadata::Configuration;
use zarrs::plugin::ZarrVersion;
use zarrs_codec::{
    CodecRuntimePluginV2, CodecRuntimePluginV3, PartialDecoderCapability, PartialEncoderCapability,
    register_codec_v2, register_codec_v3,
};

/// Has arrays be read that are packed so.
pub(super) fn register() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let create = || Ok(Codec::BytesToBytes(Arc::new(Lz4)));
        register_codec_v2(CodecRuntimePluginV2::new(|name| name == "lz4", move |_| create()));
        let is_name = |name: &str| matches!(name, "lz4" | "numcodecs.lz4");
        register_codec_v3(CodecRuntimePluginV3::new(is_name, move |_| create()));
    });
}

#[derive(Debug)]
struct Lz4;

zarrs::plugin::impl_extension_aliases!(Lz4, v3: "numcodecs.lz4", [], v2: "lz4", []);

/// Bytes of the length.
const LENGTH: usize = 4;

impl CodecTraits for Lz4 {
    fn as_any(&self) -> &dyn std::any::Any {
        self
    }

    fn configuration(&self, _: ZarrVersion, _: &CodecMetadataOptions) -> Option<Configuration> {
        Some(Configuration::default())
    }

    fn partial_decoder_capability(&self) -> PartialDecoderCapability {
        PartialDecoderCapability { partial_read: false, partial_decode: false }
    }

    fn partial_encoder_capability(&self) -> PartialEncoderCapability {
        PartialEncoderCapability { partial_encode: false }
    }
}

impl BytesToBytesCodecTraits for Lz4 {
    fn into_dyn(self: Arc<Self>) -> Arc<dyn BytesToBytesCodecTraits> {
        self
    }

    fn recommended_concurrency(&self, _: &BytesRepresentation) -> Result<RecommendedConcurrency, CodecError> {
        Ok(RecommendedConcurrency::new_maximum(1))
    }

    fn encode<'a>(
        &self,
        decoded: ArrayBytesRaw<'a>,
        _: &CodecOptions,
    ) -> Result<ArrayBytesRaw<'a>, CodecError> {
        let length = u32::try_from(decoded.len());
        let length = length.map_err(|_| CodecError::Other("lz4: a chunk of more than 4 GiB".into()))?;
        let mut encoded = length.to_le_bytes().to_vec();
        encoded.extend(lz4_flex::block::compress(&decoded));
        Ok(Cow::Owned(encoded))
    }

    fn decode<'a>(
        &self,
        encoded: ArrayBytesRaw<'a>,
        decoded: &BytesRepresentation,
        _: &CodecOptions,
    ) -> Result<ArrayBytesRaw<'a>, CodecError> {
        let damaged = |what: String| CodecError::Other(format!("lz4: {what}"));
        let (length, block) =
            encoded.split_first_chunk::<LENGTH>().ok_or_else(|| damaged("no length".into()))?;
        let length = u64::from(u32::from_le_bytes(*length));
        // A block gives at most 255 bytes for one.
        let most = decoded.size().unwrap_or(u64::MAX).min(255 * (block.len() as u64 + 1));
        if length > most {
            return Err(damaged(format!("{length} bytes where there are at most {most}")));
        }
        let bytes = lz4_flex::block::decompress(block, length as usize);
        let bytes = bytes.map_err(|error| damaged(error.to_string()))?;
        if bytes.len() as u64 != length {
            return Err(damaged(format!("{} bytes instead of {length}", bytes.len())));
        }
        Ok(Cow::Owned(bytes))
    }

    fn encoded_representation(&self, decoded: &BytesRepresentation) -> BytesRepresentation {
        decoded.size().map_or(BytesRepresentation::UnboundedSize, |size| {
            BytesRepresentation::BoundedSize(LENGTH as u64 + size + size / 255 + 16)
        })
    }
}
