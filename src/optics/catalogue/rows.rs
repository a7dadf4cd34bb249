//! The rows of the catalogue, numbers as printed. docs/materials.md says how each number was checked.

use super::{Coefficients, ListedReflectance, Measured};

/// A row of [JMLH01], figure 5: reduced coefficients in 1/mm.
const fn jensen(
    name: &'static str,
    sigma_s_prime_per_mm: [f64; 3],
    sigma_a_per_mm: [f64; 3],
    eta: f64,
    reflectance: ListedReflectance,
) -> Measured {
    Measured {
        name,
        source: "JMLH01",
        table: "figure 5",
        coefficients: Coefficients::Reduced { sigma_s_prime_per_mm, sigma_a_per_mm },
        eta,
        reflectance: Some(reflectance),
        provenance: "coefficients as in [PJH16] and [JAK10]; they reproduce the listed reflectance within 0.02",
    }
}

/// R_d as the paper prints it, two decimals.
const fn printed(value: [f64; 3]) -> ListedReflectance {
    ListedReflectance { value, digits: 2, source: "JMLH01" }
}

/// R_d as listed in the documentation of RenderMan for the same coefficients, where no copy of the printed column
/// was at hand.
const fn renderman(value: [f64; 3]) -> ListedReflectance {
    ListedReflectance { value, digits: 3, source: "PIX05" }
}

/// A row of [NGD06], table 1: coefficients of what was in the tank, in 10⁻² per mm. The paper measures no index; water
/// is 1.33.
const fn tank(
    name: &'static str,
    sigma_t_per_100_mm: [f64; 3],
    sigma_s_per_100_mm: [f64; 3],
    g: [f64; 3],
    volume_ml: Option<f64>,
) -> Measured {
    Measured {
        name,
        source: "NGD06",
        table: "table 1",
        coefficients: Coefficients::Tank { sigma_t_per_100_mm, sigma_s_per_100_mm, g, volume_ml },
        eta: 1.33,
        reflectance: None,
        provenance: "diluted values as in [JAK10], times the dilution equal to [PJH16] to 2e-4; index of water assumed",
    }
}

/// All measured media.
pub static CATALOGUE: &[Measured] = &[
    jensen("apple", [2.29, 2.39, 1.97], [0.0030, 0.0034, 0.046], 1.3, renderman([0.846, 0.841, 0.528])),
    // One public list prints 0.0015 and 0.0018 for the red absorption of the two chickens: a slipped point, since
    // these reflect 0.31 and 0.32 only with the values here.
    jensen("chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19], 1.3, renderman([0.314, 0.156, 0.126])),
    jensen("chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.20], 1.3, renderman([0.321, 0.160, 0.108])),
    jensen("cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163], 1.3, printed([0.98, 0.90, 0.73])),
    jensen("ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45], 1.3, printed([0.16, 0.01, 0.00])),
    jensen("marble", [2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071], 1.5, printed([0.83, 0.79, 0.75])),
    jensen("potato", [0.68, 0.70, 0.55], [0.0024, 0.0090, 0.12], 1.3, printed([0.77, 0.62, 0.21])),
    jensen("skimmilk", [0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142], 1.3, printed([0.81, 0.81, 0.69])),
    jensen("skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48], 1.3, printed([0.44, 0.22, 0.13])),
    jensen("skin2", [1.09, 1.59, 1.79], [0.013, 0.070, 0.145], 1.3, printed([0.63, 0.44, 0.34])),
    jensen("spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0], 1.3, printed([1.00, 1.00, 1.00])),
    jensen("wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014], 1.3, printed([0.91, 0.88, 0.76])),
    // name, extinction, scattering, mean cosine, millilitres in the tank
    tank("lowfat_milk", [0.9126, 1.0748, 1.2500], [0.9124, 1.0744, 1.2492], [0.932, 0.902, 0.859], Some(16.0)),
    tank("reduced_milk", [1.0750, 1.2213, 1.3941], [1.0748, 1.2209, 1.3931], [0.819, 0.797, 0.746], Some(18.0)),
    tank("regular_milk", [1.1874, 1.3296, 1.4602], [1.1873, 1.3293, 1.4589], [0.750, 0.714, 0.681], Some(15.0)),
    tank("espresso", [0.4376, 0.5115, 0.6048], [0.2707, 0.2828, 0.2970], [0.907, 0.896, 0.880], Some(8.0)),
    tank("mint_mocha_coffee", [0.1900, 0.2600, 0.3500], [0.0916, 0.1081, 0.1460], [0.910, 0.907, 0.914], Some(6.0)),
    tank("lowfat_soy_milk", [0.1419, 0.1625, 0.2740], [0.1418, 0.1620, 0.2715], [0.850, 0.853, 0.842], Some(16.0)),
    tank("regular_soy_milk", [0.2434, 0.2719, 0.4597], [0.2433, 0.2714, 0.4563], [0.873, 0.858, 0.832], Some(12.0)),
    tank(
        "lowfat_chocolate_milk",
        [0.4282, 0.5014, 0.5791],
        [0.4277, 0.4998, 0.5723],
        [0.934, 0.927, 0.916],
        Some(10.0),
    ),
    tank(
        "regular_chocolate_milk",
        [0.7359, 0.9172, 1.0688],
        [0.7352, 0.9142, 1.0588],
        [0.862, 0.838, 0.806],
        Some(16.0),
    ),
    tank("coke", [0.7143, 1.1688, 1.7169], [0.0177, 0.0208, 0.0000], [0.965, 0.972, 0.000], Some(1600.0)),
    tank("pepsi", [0.6433, 0.9990, 1.4420], [0.0058, 0.0141, 0.0000], [0.926, 0.979, 0.000], Some(1600.0)),
    tank("sprite", [0.1299, 0.1283, 0.1395], [0.0069, 0.0089, 0.0089], [0.943, 0.953, 0.952], Some(15000.0)),
    tank("gatorade", [0.4009, 0.4185, 0.4324], [0.2392, 0.2927, 0.3745], [0.933, 0.933, 0.935], Some(1500.0)),
    tank("chardonnay", [0.1577, 0.1748, 0.3512], [0.0030, 0.0047, 0.0069], [0.914, 0.958, 0.975], Some(3300.0)),
    tank("white_zinfandel", [0.1763, 0.2370, 0.2913], [0.0031, 0.0048, 0.0066], [0.919, 0.943, 0.972], Some(3300.0)),
    tank("merlot", [0.7639, 1.6429, 1.9196], [0.0053, 0.0000, 0.0000], [0.974, 0.000, 0.000], Some(1500.0)),
    tank("budweiser_beer", [0.1486, 0.3210, 0.7360], [0.0037, 0.0069, 0.0074], [0.917, 0.956, 0.982], Some(2900.0)),
    tank("coors_light_beer", [0.0295, 0.0663, 0.1521], [0.0027, 0.0055, 0.0000], [0.918, 0.966, 0.000], Some(1000.0)),
    tank("clorox", [0.1600, 0.2500, 0.3300], [0.1425, 0.1723, 0.1928], [0.912, 0.905, 0.892], Some(1200.0)),
    tank("apple_juice", [0.1215, 0.2101, 0.4407], [0.0201, 0.0243, 0.0323], [0.947, 0.949, 0.945], Some(1800.0)),
    tank("cranberry_juice", [0.2700, 0.6300, 0.8300], [0.0128, 0.0155, 0.0196], [0.947, 0.951, 0.974], Some(1500.0)),
    tank("grape_juice", [0.5500, 1.2500, 1.5300], [0.0072, 0.0000, 0.0000], [0.961, 0.000, 0.000], Some(1200.0)),
    tank(
        "ruby_grapefruit_juice",
        [0.2513, 0.3517, 0.4305],
        [0.1617, 0.1606, 0.1669],
        [0.929, 0.929, 0.931],
        Some(240.0),
    ),
    tank(
        "white_grapefruit_juice",
        [0.3609, 0.3800, 0.5632],
        [0.3513, 0.3669, 0.5237],
        [0.548, 0.545, 0.565],
        Some(160.0),
    ),
    tank("shampoo", [0.0288, 0.0710, 0.0952], [0.0104, 0.0114, 0.0147], [0.910, 0.905, 0.920], Some(300.0)),
    tank("strawberry_shampoo", [0.0217, 0.0788, 0.1022], [0.0028, 0.0032, 0.0033], [0.927, 0.935, 0.994], Some(300.0)),
    tank(
        "head_and_shoulders_shampoo",
        [0.3674, 0.4527, 0.5211],
        [0.2791, 0.2890, 0.3086],
        [0.911, 0.896, 0.884],
        Some(240.0),
    ),
    tank("lemon_tea_powder", [0.3400, 0.5800, 0.8800], [0.0798, 0.0898, 0.1073], [0.946, 0.946, 0.949], None),
    tank("orange_powder", [0.3377, 0.5573, 1.0122], [0.1928, 0.2132, 0.2259], [0.919, 0.918, 0.922], None),
    tank("pink_lemonade_powder", [0.2400, 0.3700, 0.4500], [0.1235, 0.1334, 0.1305], [0.902, 0.902, 0.904], None),
    tank("cappuccino_powder", [0.2574, 0.3536, 0.4840], [0.0654, 0.0882, 0.1568], [0.849, 0.843, 0.926], None),
    tank("salt_powder", [0.7600, 0.8685, 0.9363], [0.2485, 0.2822, 0.3216], [0.802, 0.793, 0.821], None),
    tank("sugar_powder", [0.0795, 0.1759, 0.2780], [0.0145, 0.0162, 0.0202], [0.921, 0.919, 0.931], None),
    tank("suisse_mocha_powder", [0.5098, 0.6476, 0.7944], [0.3223, 0.3583, 0.4148], [0.907, 0.894, 0.888], None),
    tank(
        "pacific_ocean_surface_water",
        [3.3645, 3.3158, 3.2428],
        [0.1800, 0.1834, 0.2281],
        [0.902, 0.825, 0.914],
        None,
    ),
];
