//! A saved model comes back bit by bit, and a file from elsewhere is refused with a reason.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::{BTreeMap, HashMap};

use lagrangian::saved::{Header, MAX_HEADER, Tensor, VERSION};
use lagrangian::{Coordinates, Error, Provenance, SavedModel};
use proptest::prelude::*;
use safetensors::tensor::{Dtype, TensorView};
use serde_json::json;

fn header() -> Header {
    Header {
        family: "lnn".into(),
        form: Some("convex".into()),
        coordinates: Coordinates::angles(2),
        architecture: json!({ "width": 64, "layers": 2, "activation": "softplus" }),
        scaling: json!({ "energy": 0.1 + 0.2 }),
        dissipation: json!({ "viscous": [0.1, 1.0 / 3.0] }),
        nominal: serde_json::Value::Null,
        actuation: serde_json::Value::Null,
        visited: None,
        provenance: Provenance {
            command: Some("lagrangian fit a.csv".into()),
            ..Provenance::of_seed(7)
        },
    }
}

fn model() -> SavedModel {
    let weight = Tensor::new(
        vec![2, 3],
        vec![1.0, -2.5, 1.0 / 3.0, f64::MIN_POSITIVE, -0.0, f64::MAX],
    )
    .unwrap();
    let scalar = Tensor::new(vec![], vec![0.1]).unwrap();
    let empty = Tensor::new(vec![0, 4], vec![]).unwrap();
    let tensors = [
        ("layer0.weight", weight),
        ("scale", scalar),
        ("none", empty),
    ];
    SavedModel {
        header: header(),
        tensors: tensors.map(|(name, t)| (name.to_string(), t)).into(),
    }
}

/// A safetensors file with this JSON as our metadata and these tensors.
fn file(own: &str, tensors: &[(&str, Dtype, Vec<usize>, Vec<u8>)]) -> Vec<u8> {
    let views: BTreeMap<&str, TensorView<'_>> = tensors
        .iter()
        .map(|(name, dtype, shape, bytes)| {
            (
                *name,
                TensorView::new(*dtype, shape.clone(), bytes).unwrap(),
            )
        })
        .collect();
    safetensors::serialize(
        views,
        Some(HashMap::from([("lagrangian".into(), own.into())])),
    )
    .unwrap()
}

fn envelope(format: &str, version: u32) -> String {
    json!({ "format": format, "version": version, "model": header() }).to_string()
}

fn refusal(bytes: &[u8]) -> Error {
    let refused = SavedModel::from_bytes(bytes).unwrap_err();
    let streamed = SavedModel::read(bytes).unwrap_err();
    assert_eq!(
        refused.to_string(),
        streamed.to_string(),
        "a file and its bytes are refused alike"
    );
    refused
}

#[test]
fn a_model_comes_back_bit_by_bit() {
    let bytes = model().to_bytes().unwrap();
    let back = SavedModel::from_bytes(&bytes).unwrap();
    assert_eq!(back, model());
    assert_eq!(SavedModel::read(&bytes[..]).unwrap(), model());
    assert!(
        back.tensors["layer0.weight"].data()[4].is_sign_negative(),
        "the sign of zero is kept"
    );
    assert_eq!(
        bytes,
        back.to_bytes().unwrap(),
        "equal models give equal bytes"
    );
}

#[test]
fn a_model_with_any_wrong_bit_is_refused() {
    let bytes = model().to_bytes().unwrap();
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(SavedModel::from_bytes(&damaged).is_err(), "bit {bit}");
        assert!(SavedModel::read(&damaged[..]).is_err(), "bit {bit}");
    }
}

#[test]
fn a_model_without_a_checksum_is_read_and_marked_only_if_it_is_an_old_one() {
    let weights = || vec![("w", Dtype::F64, vec![1], vec![0; 8])];
    let old = file(&envelope("lagrangian-model", 1), &weights());
    assert!(
        SavedModel::from_bytes(&old)
            .unwrap()
            .header
            .provenance
            .unverified
    );
    let new = model().to_bytes().unwrap();
    assert!(
        !SavedModel::from_bytes(&new)
            .unwrap()
            .header
            .provenance
            .unverified
    );
    let without = file(&envelope("lagrangian-model", VERSION), &weights());
    assert!(refusal(&without).to_string().contains("checksum"));
    let none = file(&envelope("lagrangian-model", 0), &weights());
    assert!(refusal(&none).to_string().contains("version 0"));
}

#[test]
fn coordinates_without_names_or_with_one_name_are_refused() {
    for name in ["", "q2"] {
        let mut model = model();
        model.header.coordinates.0[0].name = name.into();
        let bytes = model.to_bytes().unwrap();
        assert!(
            refusal(&bytes).to_string().contains("coordinates"),
            "{name}"
        );
    }
}

#[test]
fn weights_in_single_precision_are_read_exactly() {
    let values = [1.5_f32, -0.1];
    let bytes = values.iter().flat_map(|x| x.to_le_bytes()).collect();
    let file = file(
        &envelope("lagrangian-model", 1),
        &[("w", Dtype::F32, vec![2], bytes)],
    );
    let model = SavedModel::from_bytes(&file).unwrap();
    assert_eq!(model.tensors["w"].data(), values.map(f64::from));
}

#[test]
fn the_safetensors_file_of_another_program_is_refused() {
    let views: BTreeMap<&str, TensorView<'_>> = BTreeMap::new();
    let foreign = safetensors::serialize(views, None).unwrap();
    assert!(matches!(refusal(&foreign), Error::NotAModel { .. }));
    assert!(matches!(
        refusal(&file(&envelope("other", 1), &[])),
        Error::NotAModel { .. }
    ));
    assert!(matches!(
        refusal(b"PK\x03\x04 surely no model of ours"),
        Error::NotAModel { .. }
    ));
}

#[test]
fn a_model_of_a_later_version_is_refused_even_if_its_header_has_changed() {
    let own = json!({ "format": "lagrangian-model", "version": VERSION + 1, "unheard": "of" })
        .to_string();
    let Error::NewerModel { found, known } = refusal(&file(&own, &[])) else {
        panic!("wrong error")
    };
    assert_eq!((found, known), (VERSION + 1, VERSION));
}

#[test]
fn a_file_cut_anywhere_or_too_long_is_refused() {
    let bytes = model().to_bytes().unwrap();
    for length in 0..bytes.len() {
        assert!(
            matches!(refusal(&bytes[..length]), Error::DamagedModel { .. }),
            "cut at {length}"
        );
    }
    let longer = [&bytes[..], b"\0"].concat();
    assert!(matches!(refusal(&longer), Error::DamagedModel { .. }));
}

#[test]
fn a_header_that_claims_too_much_is_refused_before_anything_is_allocated() {
    for claim in [MAX_HEADER as u64 + 1, 1 << 40, u64::MAX] {
        let bytes = [&claim.to_le_bytes()[..], b"{}"].concat();
        assert!(matches!(refusal(&bytes), Error::NotAModel { .. }));
    }
    let tensor = format!(
        r#"{{"dtype":"F64","shape":[{0}],"data_offsets":[0,{1}]}}"#,
        1_u64 << 50,
        1_u64 << 53
    );
    let own = serde_json::to_string(&envelope("lagrangian-model", 1)).unwrap();
    let json = format!(r#"{{"__metadata__":{{"lagrangian":{own}}},"w":{tensor}}}"#);
    let bytes = [&(json.len() as u64).to_le_bytes()[..], json.as_bytes()].concat();
    assert!(matches!(refusal(&bytes), Error::DamagedModel { .. }));
}

#[test]
fn a_header_too_long_to_be_read_back_is_not_written() {
    let mut model = model();
    model.header.architecture = json!("x".repeat(MAX_HEADER));
    assert!(model.to_bytes().is_err());
}

#[test]
fn weights_that_are_not_finite_are_neither_read_nor_written() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let bytes = [1.0, bad].iter().flat_map(|x| x.to_le_bytes()).collect();
        let file = file(
            &envelope("lagrangian-model", 1),
            &[("w", Dtype::F64, vec![2], bytes)],
        );
        assert!(
            refusal(&file).to_string().contains("'w' is"),
            "{}",
            refusal(&file)
        );
        assert!(Tensor::new(vec![1], vec![bad]).is_err());
    }
}

#[test]
fn weights_of_other_types_are_refused_by_name() {
    let file = file(
        &envelope("lagrangian-model", 1),
        &[("w", Dtype::I64, vec![1], vec![0; 8])],
    );
    assert!(
        refusal(&file)
            .to_string()
            .contains("weight 'w' is of type I64")
    );
}

#[test]
fn missing_unknown_and_misshapen_weights_are_named() {
    let model = model();
    let mut expected: Vec<_> = model
        .tensors
        .iter()
        .map(|(name, t)| (name.clone(), t.shape().to_vec()))
        .collect();
    model.expect_tensors(&expected).unwrap();
    let refusal =
        |expected: &[(String, Vec<usize>)]| model.expect_tensors(expected).unwrap_err().to_string();
    expected[0].1 = vec![3, 2];
    assert!(refusal(&expected).contains("'layer0.weight' has shape [2, 3] instead of [3, 2]"));
    assert!(refusal(&expected[1..]).contains("'layer0.weight' does not belong"));
    assert!(refusal(&[("more".into(), vec![])]).contains("'more' is missing"));
    assert!(model.tensor("scale", &[1]).is_err());
    assert_eq!(model.tensor("scale", &[]).unwrap().len(), 1);
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(SavedModel::from_bytes(&bytes).is_err());
        prop_assert!(SavedModel::read(&bytes[..]).is_err());
    }

    #[test]
    fn a_model_with_some_bytes_changed_never_panics(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8)
    ) {
        let mut bytes = model().to_bytes().unwrap();
        for (index, value) in changes {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        let whole = SavedModel::from_bytes(&bytes).is_ok();
        prop_assert_eq!(whole, SavedModel::read(&bytes[..]).is_ok());
    }

    #[test]
    fn an_arbitrary_json_header_never_panics(text in "[\\[\\]{}\",:a-z0-9_]{0,80}") {
        let bytes = [&(text.len() as u64).to_le_bytes()[..], text.as_bytes()].concat();
        prop_assert!(SavedModel::from_bytes(&bytes).is_err());
    }
}

mod families {
    use super::*;
    use lagrangian::mechanics::{Directional, Jet, Scaling};
    use lagrangian::models::{
        Angles, Delan, Direction, Form, Inertia, Lnn, Mlp, MlpScaling, Rigid, RigidChain,
    };
    use lagrangian::{
        DelanConfig, Learned, LnnConfig, Model,
        mechanics::{Dissipation, Mechanical},
        models::MlpConfig,
    };

    fn lnn(form: Form) -> Lnn {
        let config = LnnConfig {
            form,
            width: 16,
            ..LnnConfig::default()
        };
        Lnn::random(Coordinates::angles(2), config, Scaling::identity(2), 5).unwrap()
    }

    fn models() -> Vec<Learned> {
        let friction = Dissipation {
            viscous: vec![0.1, 1.0 / 3.0],
            drag: Some(vec![0.3, 0.0]),
            coulomb: vec![0.0, 0.2],
            smoothing: vec![0.01; 2],
            stribeck: None,
            load: Some(vec![0.1, 0.0]),
            between: Some(vec![0.0, -0.1, -0.1, 0.0]),
            directional: Some(Directional {
                external: vec![0.2, 1.0 / 3.0],
                ..Directional::none(2)
            }),
        };
        let mlp = |direction| {
            let config = MlpConfig {
                width: 16,
                direction,
                ..MlpConfig::default()
            };
            let scaling = MlpScaling {
                inputs: Scaling::identity(2),
                qdd: vec![1.0 / 3.0, 2.0],
                tau: vec![1.0, 0.7],
            };
            Learned::from(Mlp::random(Coordinates::angles(2), config, scaling, 5).unwrap())
        };
        vec![
            Learned::from(Mechanical::conservative(lnn(Form::Free))),
            Learned::from(Mechanical::dissipative(lnn(Form::Convex), friction).unwrap()),
            mlp(Direction::Forward),
            mlp(Direction::Inverse),
            rigid(),
        ]
    }

    fn rigid() -> Learned {
        let pi = vec![0.3, 0.1, 0.2, 0.01, 2.0, 1.0 / 3.0, 0.0, 0.1, 0.0, 0.0];
        let chain = RigidChain::new(Coordinates::angles(2), Angles::Relative, pi).unwrap();
        let friction = Dissipation::viscous(vec![0.1, 0.2]);
        let motion = Mechanical::dissipative(chain, friction).unwrap();
        Learned::from(Rigid::new(motion, vec![0.01; 14]).unwrap())
    }

    /// Both directions; NaN and zeros for a direction that the model lacks.
    fn dynamics(model: &Learned) -> [u64; 4] {
        let (q, qd, third) = ([0.3, -1.2], [2.0, 0.5], [0.1, -0.4]);
        let (mut qdd, mut tau) = ([0.0; 2], [0.0; 2]);
        let mut evaluator = model.evaluator();
        let _ = evaluator.forward_dynamics(&q, &qd, &third, &mut qdd);
        let _ = evaluator.inverse_dynamics(&q, &qd, &third, &mut tau);
        [qdd[0], qdd[1], tau[0], tau[1]].map(f64::to_bits)
    }

    #[test]
    fn every_family_moves_with_the_same_bits_after_it_was_saved() {
        for model in models() {
            let bytes = model
                .save(Provenance::of_seed(5))
                .unwrap()
                .to_bytes()
                .unwrap();
            let back = Learned::load(&SavedModel::from_bytes(&bytes).unwrap()).unwrap();
            assert_eq!(dynamics(&back), dynamics(&model));
        }
    }

    #[test]
    fn a_network_of_constant_inertia_is_saved_as_a_vin_and_one_whose_inertia_moves_is_none() {
        for (inertia, name) in [
            (Inertia::Constant, "vin"),
            (Inertia::Configuration, "delan"),
        ] {
            let config = DelanConfig {
                inertia,
                width: 16,
                ..DelanConfig::default()
            };
            let angles = Coordinates::angles(2);
            let delan = Delan::random(angles, config, Scaling::identity(2), 5).unwrap();
            let model = Learned::from(Mechanical::conservative(delan));
            assert_eq!(model.family(), name);
            let mut saved = model.save(Provenance::of_seed(5)).unwrap();
            assert_eq!(saved.header.family, name);
            assert_eq!(dynamics(&Learned::load(&saved).unwrap()), dynamics(&model));
            // A vin of an older version was saved as a delan; a delan was never a vin.
            saved.header.family = if name == "vin" { "delan" } else { "vin" }.into();
            assert_eq!(Learned::load(&saved).is_ok(), name == "vin");
        }
    }

    #[test]
    fn a_convex_network_with_a_negative_weight_on_the_path_of_the_velocity_is_refused() {
        let (free, convex) = (lnn(Form::Free), lnn(Form::Convex));
        let with = |lnn: &Lnn, parameters: Vec<f64>| {
            Lnn::with_parameters(
                Coordinates::angles(2),
                lnn.config().clone(),
                Scaling::identity(2),
                parameters,
            )
        };
        let negative = |lnn: &Lnn, at: usize| {
            let mut parameters = lnn.parameters().to_vec();
            parameters[at] = -parameters[at].abs() - 0.1;
            with(lnn, parameters)
        };
        let count = convex.parameters().len();
        let refused: Vec<usize> = (0..count)
            .filter(|&at| negative(&convex, at).is_err())
            .collect();
        assert!(!refused.is_empty() && refused.len() < count);
        assert!(refused.iter().all(|&at| convex.parameters()[at] >= 0.0));
        let message = negative(&convex, refused[0]).unwrap_err().to_string();
        assert!(message.contains("not convex"), "{message}");
        assert!((0..free.parameters().len()).all(|at| negative(&free, at).is_ok()));
    }

    #[test]
    fn a_damaged_model_is_refused_or_still_has_a_positive_mass_matrix() {
        let model = Learned::from(Mechanical::conservative(lnn(Form::Convex)));
        let saved = model.save(Provenance::of_seed(5)).unwrap();
        let weights = saved.tensors["parameters"].data().to_vec();
        for k in 0..200 {
            let mut damaged = weights.clone();
            let at = k * 7919 % damaged.len();
            damaged[at] = f64::from_bits(damaged[at].to_bits() ^ (1 << (k % 64)));
            let Ok(tensor) = Tensor::new(vec![damaged.len()], damaged) else {
                continue;
            };
            let mut changed = saved.clone();
            changed.tensors.insert("parameters".into(), tensor);
            let Ok(model) = Learned::load(&changed) else {
                continue;
            };
            let mut jet = Jet::default();
            model
                .lagrangian()
                .unwrap()
                .jets()
                .jet(&[0.3, -1.2], &[2.0, 0.5], &mut jet);
            let mass = jet.mass_matrix;
            let finite = mass.iter().all(|m| m.is_finite());
            assert!(!finite || (mass[0] > 0.0 && mass[3] > 0.0), "{k}: {mass:?}");
        }
    }

    #[test]
    fn a_description_that_does_not_belong_to_the_weights_is_refused() {
        for model in models() {
            let saved = model.save(Provenance::of_seed(5)).unwrap();
            let changed = |change: &dyn Fn(&mut SavedModel)| {
                let mut changed = saved.clone();
                change(&mut changed);
                Learned::load(&changed)
            };
            assert!(changed(&|_| ()).is_ok());
            assert!(changed(&|m| m.header.family = "oracle".into()).is_err());
            assert!(changed(&|m| m.header.architecture["width"] = json!(32)).is_err());
            assert!(changed(&|m| m.header.architecture["width"] = json!(-1)).is_err());
            assert!(changed(&|m| m.header.architecture["unheard"] = json!(1)).is_err());
            assert!(changed(&|m| m.header.coordinates = Coordinates::lines(1)).is_err());
            assert!(changed(&|m| m.header.coordinates = Coordinates(vec![])).is_err());
            assert!(changed(&|m| m.header.scaling = json!({})).is_err());
            assert!(
                changed(&|m| m.header.dissipation = json!({ "viscous": [1.0] })).is_err()
                    || model.family() != "lnn"
            );
            assert!(changed(&|m| m.tensors.clear()).is_err());
        }
    }
}
