//! A module of WebAssembly for browsers without relaxed SIMD, made from the one with it.

use wasm_encoder::reencode::{self, Reencode};
use wasm_encoder::{CodeSection, Function, Instruction, Module, RawSection, ValType};
use wasmparser::{FunctionBody, Operator, Parser, Payload, Validator, WasmFeatures};

/// The same module, each fused multiply-add as a product and a sum, and each other relaxed instruction as the one of plain SIMD
/// that computes one of the results that it may have.
///
/// # Errors
/// Where the bytes are no module, or one that uses relaxed instructions which no single one stands for.
pub(crate) fn plain(module: &[u8]) -> Result<Vec<u8>, String> {
    let words = |e: &dyn std::fmt::Display| format!("the module without relaxed SIMD: {e}");
    let mut lowering = Lowering {
        parameters: parameters(module).map_err(|e| words(&e))?,
        next: 0,
    };
    let mut plain = Module::new();
    lowering
        .parse_core_module(&mut plain, Parser::new(0), module)
        .map_err(|e| words(&e))?;
    let plain = plain.finish();
    let features = WasmFeatures::default() - WasmFeatures::RELAXED_SIMD;
    let checked = Validator::new_with_features(features).validate_all(&plain);
    checked.map(|_| plain).map_err(|e| words(&e))
}

/// The same module without names of functions and other custom sections, a tenth of what a browser would load.
///
/// # Errors
/// Where the bytes are no module.
pub(crate) fn stripped(module: &[u8]) -> Result<Vec<u8>, String> {
    let mut bare = Module::new();
    for payload in Parser::new(0).parse_all(module) {
        let payload = payload.map_err(|e| format!("the module: {e}"))?;
        if let Some((id, range)) = payload.as_section().filter(|own| own.0 != CUSTOM) {
            let data = &module[range.start as usize..range.end as usize];
            bare.section(&RawSection { id, data });
        }
    }
    Ok(bare.finish())
}

/// The id of custom sections.
const CUSTOM: u8 = 0;

/// The number of parameters of each function of the code section.
fn parameters(module: &[u8]) -> wasmparser::Result<Vec<u32>> {
    let (mut of_type, mut of_function) = (Vec::new(), Vec::new());
    for payload in Parser::new(0).parse_all(module) {
        match payload? {
            Payload::TypeSection(types) => {
                for own in types.into_iter_err_on_gc_types() {
                    of_type.push(own?.params().len() as u32);
                }
            }
            Payload::FunctionSection(functions) => {
                for own in functions {
                    of_function.push(of_type.get(own? as usize).copied().unwrap_or(0));
                }
            }
            _ => {}
        }
    }
    Ok(of_function)
}

/// Writes a module again with other code.
struct Lowering {
    parameters: Vec<u32>,
    /// The function of the code section that comes next.
    next: usize,
}

impl Reencode for Lowering {
    type Error = std::convert::Infallible;

    fn parse_function_body(
        &mut self,
        code: &mut CodeSection,
        body: FunctionBody<'_>,
    ) -> Result<(), reencode::Error<Self::Error>> {
        let mut locals = Vec::new();
        // A local more, which holds the summand while the factors are multiplied.
        let mut summand = self.parameters.get(self.next).copied().unwrap_or(0);
        self.next += 1;
        for local in body.get_locals_reader()? {
            let (count, kind) = local?;
            summand += count;
            locals.push((count, self.val_type(kind)?));
        }
        locals.push((1, ValType::V128));
        let mut function = Function::new(locals);
        for operator in body.get_operators_reader()? {
            let [multiply, add] = match operator? {
                Operator::F64x2RelaxedMadd => [Instruction::F64x2Mul, Instruction::F64x2Add],
                Operator::F32x4RelaxedMadd => [Instruction::F32x4Mul, Instruction::F32x4Add],
                other => {
                    let instruction = match counterpart(&other) {
                        Some(plain) => plain,
                        None => self.instruction(other)?,
                    };
                    function.instruction(&instruction);
                    continue;
                }
            };
            function
                .instruction(&Instruction::LocalSet(summand))
                .instruction(&multiply)
                .instruction(&Instruction::LocalGet(summand))
                .instruction(&add);
        }
        code.function(&function);
        Ok(())
    }
}

/// The instruction of plain SIMD that stands for a relaxed one.
fn counterpart(operator: &Operator<'_>) -> Option<Instruction<'static>> {
    Some(match operator {
        Operator::F32x4RelaxedMin => Instruction::F32x4Min,
        Operator::F32x4RelaxedMax => Instruction::F32x4Max,
        Operator::F64x2RelaxedMin => Instruction::F64x2Min,
        Operator::F64x2RelaxedMax => Instruction::F64x2Max,
        Operator::I32x4RelaxedTruncF32x4S => Instruction::I32x4TruncSatF32x4S,
        Operator::I32x4RelaxedTruncF32x4U => Instruction::I32x4TruncSatF32x4U,
        Operator::I8x16RelaxedSwizzle => Instruction::I8x16Swizzle,
        Operator::I8x16RelaxedLaneselect
        | Operator::I16x8RelaxedLaneselect
        | Operator::I32x4RelaxedLaneselect
        | Operator::I64x2RelaxedLaneselect => Instruction::V128Bitselect,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use wasm_encoder::{FunctionSection, TypeSection};

    /// A function of three vectors and these instructions.
    fn module(instructions: &[Instruction]) -> Vec<u8> {
        let vectors = [ValType::V128; 3];
        let (mut types, mut functions) = (TypeSection::new(), FunctionSection::new());
        types.ty().function(vectors, [ValType::V128]);
        functions.function(0);
        let mut function = Function::new([]);
        (0..3).for_each(|k| {
            function.instruction(&Instruction::LocalGet(k));
        });
        for own in instructions {
            function.instruction(own);
        }
        function.instruction(&Instruction::End);
        let mut code = CodeSection::new();
        code.function(&function);
        let mut module = Module::new();
        module.section(&types).section(&functions).section(&code);
        module.finish()
    }

    /// The instructions of the module that is made from that of these.
    fn lowered(instructions: &[Instruction]) -> Vec<String> {
        let plain = plain(&module(instructions)).unwrap_or_default();
        let mut operators = Vec::new();
        for payload in Parser::new(0).parse_all(&plain).flatten() {
            if let Payload::CodeSectionEntry(body) = payload {
                let reader = body.get_operators_reader().into_iter().flatten();
                operators.extend(reader.flatten().map(|own| format!("{own:?}")));
            }
        }
        operators
    }

    #[test]
    fn a_module_without_names_is_the_same_module() {
        let bare = module(&[Instruction::F64x2RelaxedMadd]);
        let custom = wasm_encoder::CustomSection {
            name: "name".into(),
            data: vec![7; 300].into(),
        };
        let mut named = bare.clone();
        named.extend(Module::new().section(&custom).as_slice()[8..].iter());
        assert_eq!(stripped(&named), Ok(bare));
        assert!(stripped(&named[..20]).is_err());
    }

    #[test]
    fn a_choice_of_lanes_becomes_one_of_bits() {
        let operators = lowered(&[Instruction::I32x4RelaxedLaneselect]);
        assert_eq!(operators.get(3).map(String::as_str), Some("V128Bitselect"));
    }

    #[test]
    fn a_multiply_add_becomes_a_product_and_a_sum() {
        let operators = lowered(&[Instruction::F64x2RelaxedMadd]);
        let get = |k: u32| format!("LocalGet {{ local_index: {k} }}");
        let set = "LocalSet { local_index: 3 }".to_string();
        let words = |own: &str| own.to_string();
        let expected = [
            get(0),
            get(1),
            get(2),
            set,
            words("F64x2Mul"),
            get(3),
            words("F64x2Add"),
            words("End"),
        ];
        assert_eq!(operators, expected);
    }

    #[test]
    fn what_else_is_relaxed_is_refused() {
        let error = plain(&module(&[Instruction::F64x2RelaxedNmadd])).err();
        let error = error.unwrap_or_default();
        assert!(error.contains("relaxed"), "{error}");
    }

    #[test]
    fn what_is_no_module_is_refused() {
        assert!(plain(b"no module").is_err());
    }
}
